"""Calling functions across the border, from either side: arguments go as plain data, what they became comes back.

The worker runs what the judge calls under `guard`, so that time, output and changed arguments are seen where they
happen. The judge runs what the worker calls, the functions among an exercise's arguments and the library's references,
with a time limit of its own.
"""

import builtins
import time
import types

import numpy as np

from ..exercises import guard, rerun
from . import wire

JUDGE_SECONDS = 20.0  # that the judge spends on one call of the worker's
SLACK = 5.0  # seconds that the worker may answer late
SENT = 1 << 16  # bytes of one of many results
AT_ONCE = 60  # changes that are tried at once


class Border:
    """One end: `handlers` answer questions by name, `run` executes what the other side calls."""

    def __init__(self, reading, writing, run, patience=None):
        self.line = wire.Line(reading, writing, self._serve, patience)
        self.run, self.ours, self.handlers, self.read = run, [], {"call": self._called}, {}

    def ask(self, do, limit=None, **content):
        """Ask the other side and return the answer's decoded content."""
        parcel = []
        head = {"do": do, **{name: self.encode(value, parcel) for name, value in content.items()}}
        return self._unpack(*self.line.ask({**head, **({} if limit is None else {"limit": limit})}, parcel))

    def encode(self, value, parcel):
        """Plain data for a value; functions are remembered, for the other side may call them."""
        functions = []
        word = wire.encode(value, parcel, functions)
        return self._named(word, functions) if functions else word

    def decode(self, word, parcel):
        """The value of plain data; the other side's functions become `Remote`s, ours are themselves again."""

        def function(k, name, parameters):
            return self.ours[-k - 1] if k < 0 else Remote(self, k, name, parameters)

        return wire.decode(word, parcel, function)

    def _named(self, word, functions):
        """The encoded value with lasting numbers for those of this message; negative for a function sent back."""
        if isinstance(word, list):
            return [self._named(part, functions) for part in word]
        if not isinstance(word, dict):
            return word
        if word.keys() == {"function"}:
            k, name, parameters = word["function"]
            return {"function": [self._number(functions[k]), name, parameters]}
        return {key: self._named(part, functions) for key, part in word.items()}

    def _number(self, function):
        remote = getattr(function, "remote", None)
        if isinstance(remote, Remote) and remote.border is self:
            return -remote.number - 1
        known = [k for k, ours in enumerate(self.ours) if ours is function]
        if not known:
            self.ours.append(function)
        return known[0] if known else len(self.ours) - 1

    def _serve(self, head, parcel):
        handler = self.handlers.get(head.get("do"))
        content = {}
        try:
            if handler is None:
                raise wire.BorderError(f"nothing is known of {head.get('do')!r}")
            words = {key: word for key, word in head.items() if key not in ("do", "asked", "limit")}
            content = {key: self.decode(word, parcel) for key, word in words.items()}
        except Exception as error:  # what cannot be read is answered like a call that failed
            return self._failure(error), []
        if handler == self._called:
            content["limit"] = head.get("limit")
        parts = []
        try:
            return handler(parts, **content), parts
        except wire.Gone:
            raise
        except BaseException as error:  # a handler's refusal is the other side's error
            return self._failure(error), []

    def _called(self, parts, function, args, kwargs, limit):
        """Run one of our functions for the other side."""
        outcome = self.run(self.ours[function], args, kwargs, limit, lambda result: self._kept(result))
        told = {"printed": outcome.printed, "spent": outcome.spent}
        if outcome.error is not None:
            return {**self._failure(outcome.error, outcome.line), "told": told}
        word, kept = outcome.result
        parts += kept
        return {
            "ok": word,
            "changed": [[k, self.encode(outcome.given[k], parts)] for k in outcome.changed],
            "moved": [[k, self.encode(v, parts)] for k, v in _generators(outcome.given)],
            "told": told,
        }

    def _rerun(self, parts, function, what, args, plans, seconds):
        """A function of ours run again for the other side, with what it computes noted or one thing in it otherwise."""
        if function not in self.read:
            self.read[function] = rerun.written(self.ours[function])
        written, began = self.read[function], time.thread_time()
        if what == "read":
            found = written and (written.changes, written.places, written.facts)
        elif what == "trace":
            found = written.trace(args, seconds), written.of_truth
        elif what == "truths":
            found = written.truths(args, seconds)
        else:
            found = written.results(plans, args, seconds, self._sent)
        return {"found": self.encode(found, parts), "spent": {"plain": time.thread_time() - began}}

    def _sent(self, found):
        """What a changed function gave; None where it cannot cross, or is larger than what is worth looking at."""
        try:
            parts = []
            wire.encode(found, parts, [])
        except Exception:  # what cannot cross is no result
            return None
        return found if sum(map(len, parts)) <= SENT and len(parts) <= 9 else None

    def _kept(self, result):
        """A result, encoded while it is still guarded: what a student's code returns may be as hostile as the code."""
        kept = []
        return self.encode(result, kept), kept

    def _failure(self, error, line=""):
        bases = [base.__name__ for base in type(error).__mro__ if base not in (object, BaseException)]
        try:
            text = str(error)[: wire.LONGEST]
        except Exception:  # a student's exception class may fail to print itself
            text = "(its message cannot be shown)"
        missing = getattr(error, "name", None) if isinstance(error, NameError) else None
        return {"error": [bases[:10], text, str(line)[: wire.LONGEST], missing if isinstance(missing, str) else None]}

    def _unpack(self, content, parcel):
        if "error" in content:
            raise rebuilt(content["error"])
        return {key: self.decode(word, parcel) for key, word in content.items() if key != "answers"}


class Remote:
    """A function on the other side of the border, to be called like any other.

    Its time is limited where it runs: `clock` takes the place of the guard's own.
    """

    def __init__(self, border, number, name, parameters):
        self.border, self.number, self.__name__ = border, number, name
        self.__code__ = types.SimpleNamespace(
            co_varnames=tuple(parameters), co_argcount=len(parameters), co_filename="", co_names=(), co_consts=()
        )
        self.left = None
        self.remote = self

    def __repr__(self):
        return f"<function {self.__name__}>"

    def __deepcopy__(self, memo):
        return self

    def written(self):
        """The function as `rerun.written` reads it on the other side; None where it cannot."""
        found, _ = self.rerun("read", otherwise=None)
        try:
            return found and Written(self, *found)
        except (TypeError, ValueError, KeyError, AttributeError):
            return None

    def rerun(self, what, args=(), plans=(), seconds=guard.TIME_LIMIT, otherwise=()):
        """What comes of running the function again on the other side, and the seconds that took; or `otherwise`."""
        content = {"args": list(args), "plans": list(plans), "seconds": float(seconds), "what": what}
        try:
            told = self.border.ask("rerun", function=self.number, **content)
            return told["found"], self._worked(told["spent"])
        except wire.Gone:
            raise
        except Exception:  # an explanation is not worth more than the answer
            return otherwise, float(seconds)

    def clock(self, seconds):
        """What limits the calls of one check to so many seconds in all."""
        return _Clock(self, seconds)

    def __call__(self, *args, **kwargs):
        border, parcel = self.border, []
        head = {"do": "call", "function": {"plain": self.number}, "limit": self.left}
        head |= {"args": border.encode(list(args), parcel), "kwargs": border.encode(kwargs, parcel)}
        content, parts = border.line.ask(head, parcel)
        try:
            told = content.pop("told", {})
            self._spend(told)
            if "error" not in content:
                self._put_back(args, content, parts)
                return border.decode(content["ok"], parts)
            error = rebuilt(content["error"])
        except Exception as nonsense:
            raise wire.Gone(f"an answer over the border made no sense: {nonsense}"[: wire.LONGEST]) from None
        raise error

    def _spend(self, told):
        if isinstance(told.get("printed"), str) and told["printed"]:
            print(told["printed"][: guard.OUTPUT_LIMIT + 100], end="")
        spent = self._worked(told.get("spent", 0.0))
        if self.left is not None:
            self.left = max(0.05, self.left - spent)

    @staticmethod
    def _worked(spent):
        """The seconds that the other side says it has worked, within reason, and counted as such."""
        spent = min(max(0.0, float(spent)), JUDGE_SECONDS)
        guard.Abroad.worked += spent
        return spent

    def _put_back(self, args, content, parts):
        """What the other side did to its copies of the arguments happens to ours."""
        for k, word in content.get("changed", ()):
            new, old = self.border.decode(word, parts), args[k]
            if isinstance(old, np.ndarray):
                if np.shape(new) != old.shape:
                    old.resize(np.shape(new), refcheck=False)
                old[...] = new
            elif isinstance(old, list):
                old[:] = new
            elif isinstance(old, dict):
                old.clear()
                old.update(new)
        for k, word in content.get("moved", ()):
            args[k].bit_generator.state = self.border.decode(word, parts).bit_generator.state


class Written:
    """`rerun.Written` of a function on the other side."""

    def __init__(self, remote, changes, places, facts):
        self.remote, self.of_truth = remote, set()
        self.changes = [(int(rank), int(line), str(code), str(mends)) for rank, line, code, mends in changes]
        self.places = [(int(n), str(code), str(name), int(size), int(k)) for n, code, name, size, k in places]
        self.lines = {int(n): str(line) for n, line in facts["lines"].items()}
        self.of_notebook = set(map(str, facts["of_notebook"]))
        self.left_alone = list(map(str, facts["left_alone"]))
        self.iterated, self.searched = (set(map(int, facts[n])) for n in ("iterated", "searched"))

    def trace(self, args, seconds):
        """As `rerun.Written.trace`."""
        (found, of_truth), _ = self.remote.rerun("trace", args, seconds=seconds, otherwise=((), ()))
        self.of_truth |= set(map(int, of_truth))
        return [_rounds(*pair) for pair in found] if len(found) == len(self.places) else [(0, None)] * len(self.places)

    def truths(self, draws, seconds):
        """As `rerun.Written.truths`."""
        found, _ = self.remote.rerun("truths", [list(args) for args in draws], seconds=seconds)
        told = [[(int(k), bool(true), bool(false), int(n)) for k, true, false, n in conditions] for conditions in found]
        return [[c for c in conditions if 0 <= c[0] < len(self.places)] for conditions in told]

    def results(self, plans, args, seconds, keep):
        """As `rerun.Written.results`."""
        kept, left = [], seconds
        for start in range(0, len(plans), AT_ONCE):
            found, spent = self.remote.rerun("results", args, plans[start : start + AT_ONCE], left)
            left -= spent
            guard.run(lambda found=found: kept.extend(map(keep, found)), (), limit=guard.TIME_LIMIT)
            if left <= 0 or len(found) < min(AT_ONCE, len(plans) - start):
                break
        return kept


def _rounds(count, values):
    """What was noted of one place on the other side, if it is what it should be."""
    ours = isinstance(values, np.ndarray) and values.dtype.kind == "f" and values.ndim and len(values) == count
    return (len(values), values) if ours else (0, None)


class _Clock:
    """Tells a remote function how many seconds it has; they are kept on the other side."""

    def __init__(self, remote, seconds):
        self.remote, self.seconds = remote, seconds

    def start(self):
        self.remote.left = self.seconds

    def stop(self):
        self.remote.left = None


def _generators(args):
    return [(k, arg) for k, arg in enumerate(args) if isinstance(arg, np.random.Generator)]


def rebuilt(word):
    """An exception as it was raised on the other side: its name, its nearest kin that both sides know, its message."""
    bases, text, line, missing = word
    bases = [str(name)[:80] for name in bases]
    kin = next((known for name in bases if (known := _known_error(name))), Exception)
    name = bases[0] if bases and bases[0].isidentifier() else "Exception"
    kind = type(name, (kin,), {"__init__": lambda self, *args: None, "__str__": lambda self: str(text)})
    error = kind()
    error.student_line = str(line)
    if isinstance(error, NameError):
        error.name = missing if isinstance(missing, str) and missing.isidentifier() else None
    return error


def _known_error(name):
    if name == "LinAlgError":
        return np.linalg.LinAlgError
    ours = [guard.TimeLimit, guard.Forbidden, *guard.Forbidden.__subclasses__()]
    found = next((kind for kind in ours if kind.__name__ == name), None) or getattr(builtins, name, None)
    return found if isinstance(found, type) and issubclass(found, BaseException) else None


def run_guarded(function, args, kwargs, limit, finish):
    """The worker's way: a student's function on copies of its arguments, guarded; what became of these is kept."""
    given = []

    def call(*copies):
        given[:] = copies
        return function(*copies, **kwargs)

    started = time.thread_time()
    run = guard.run(call, tuple(args), finish, limit or guard.TIME_LIMIT, author=function)
    run.given, run.spent = given, time.thread_time() - started
    return run


def run_trusted(function, args, kwargs, limit, finish):
    """The judge's way: its own function on a student's arguments, which may still ask for too much."""
    run = guard.Run()
    run.given, run.spent = args, 0.0
    try:
        with guard.time_limit(JUDGE_SECONDS):
            run.result = finish(function(*args, **kwargs))
    except guard.TimeLimit:
        run.error = TimeoutError(f"this call of the library takes longer than {JUDGE_SECONDS:g} s")
    except wire.Gone:
        raise
    except BaseException as error:
        run.error = error
    return run
