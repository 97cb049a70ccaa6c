"""Every public function of the mathematics, called with spoilt arguments: a table by outcome.

    python tests/bench/fuzz.py [--calls 100000] [--seed 1] [--examples] [ROOM | MODULE.FUNCTION | MODULE.FUNCTION:CALL]

Arguments are recorded while the unit tests of the rooms run, and spoilt once to three times a call: shapes, NaN and
infinities, signs, zeros, wrong kinds, asymmetric and indefinite covariances, matrices that are no rotations, swapped
arguments (`fuzz_mutations.py`). A call that holds a number above 1e9, arrays below 1e-12 or a count above 1e5 is
"extreme"; every other one is of ordinary magnitude, and there only three outcomes are right: a finite result, NaN where
the docstring says so, or a sentence: labkit's own, or the system's about a file, with its name. What a function that
was handed in raises, SciPy's `rosen_hess` of no numbers say, is its caller's and passes unchanged. Each call has 10 s
and 4 GB. Linux and macOS; 20 to 40 minutes.

Seeded: the arguments of MODULE.FUNCTION:CALL, as `--examples` names it, are the same in every run.
"""

import argparse
import contextlib
import copy
import dataclasses
import gc
import importlib
import inspect
import io
import linecache
import multiprocessing
import os
import pkgutil
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import types
import warnings
import zlib
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).resolve().parent)]
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from fuzz_mutations import is_numeric, spoil

import labkit
from labkit import checks

ROOMS = ("geometry", "estimation", "calibration", "machines", "localization", "fast")
LEFT_OUT = {
    "machines.udp.Listener": "opens a port and starts a thread",
    "machines.udp.Sender": "opens a port and starts a thread",
    "machines.udp.stream": "sleeps between packets",
}
PATIENCE = 300.0  # s until a process counts as stuck in compiled code; a busy machine lends it its time in pieces
SMALL = 20_000  # numbers; of calls with more, one is kept where there is no other
KEPT = 10  # recorded calls of a function, of unlike shapes
LONG_ENOUGH = 1.0  # s of one test; most of what comes later repeats what came before
SECONDS, BYTES = 10.0, 4 << 30  # of processor time and memory for one call
LARGEST, SMALLEST, LARGEST_COUNT = 1e9, 1e-12, 100_000
OUTCOMES = ("finite", "refused", "file", "NaN as documented", "NaN or inf", "foreign", "caller's function", "hang")
FUNCTIONS = (types.FunctionType, types.BuiltinFunctionType, np.ufunc, type)
RIGHT = {"finite", "refused", "file", "NaN as documented", "caller's function"}


class Hang(BaseException):
    """Raised in a call that takes too long."""


# --- what there is to call, and with what ----------------------------------------------------------------------------


def public():
    """{code: (name, how to call it)} of all public functions, methods and constructors of the rooms."""
    found = {}
    for room in ROOMS:
        package = importlib.import_module(f"labkit.{room}")
        for info in pkgutil.iter_modules(package.__path__):
            module = importlib.import_module(f"labkit.{room}.{info.name}")
            for name, value in vars(module).items():
                if not name.startswith("_") and getattr(value, "__module__", "") == module.__name__:
                    _add(found, f"{room}.{info.name}.{name}", value)
    return {code: entry for code, entry in found.items() if not entry[0].startswith(tuple(LEFT_OUT))}


def _add(found, name, value):
    if isinstance(value, type):
        made = vars(value).get("__post_init__" if dataclasses.is_dataclass(value) else "__init__")
        if made is not None:
            found[inspect.unwrap(made).__code__] = (name, value)
        for key, member in vars(value).items():
            function = getattr(member, "__func__", member)
            if isinstance(function, types.FunctionType) and (not key.startswith("_") or key == "__call__"):
                found[inspect.unwrap(function).__code__] = (f"{name}.{key}", getattr(value, key))
    elif callable(value) and hasattr(inspect.unwrap(value), "__code__"):
        found[inspect.unwrap(value).__code__] = (name, value)


def record(functions, rooms, scratch):
    """{name: [arguments]} met while the unit tests of the rooms run; the files they name stay in a folder."""
    kept, shapes, begun = defaultdict(list), defaultdict(set), [0.0]

    def meet(frame, event, _):
        if event != "call" or frame.f_code not in functions:
            return
        name, function = functions[frame.f_code]
        if len(kept[name]) >= KEPT:
            return
        sys.setprofile(None)
        if time.process_time() - begun[0] > LONG_ENOUGH:
            pytest.skip("all there is to record has been seen")
        try:
            arguments = _arguments(frame, function)
            form, large = repr([_form(v) for v in arguments.values()]), sum(map(_size, arguments.values())) > SMALL
            if form not in shapes[name] and not (large and kept[name]):
                kept[name].append(copy.deepcopy(arguments))
                shapes[name].add(form)
        except Exception:  # what cannot be copied cannot be called again
            pass
        finally:
            sys.setprofile(meet)

    class Plugin:
        @pytest.hookimpl(hookwrapper=True)
        def pytest_runtest_call(self, item):
            begun[0] = time.process_time()
            sys.setprofile(meet)
            yield
            sys.setprofile(None)

    words = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "--deselect", "tests/machines/test_udp.py"]
    words += ["--basetemp", scratch, "-o", "tmp_path_retention_policy=all"]
    with contextlib.redirect_stdout(io.StringIO()) as said:
        code = pytest.main([*words, *(str(ROOT / "tests" / room) for room in rooms)], plugins=[Plugin()])
    if code:
        raise SystemExit(said.getvalue())
    return dict(kept)


def _arguments(frame, function):
    """{parameter: value} of a call; of a dataclass, its fields."""
    if isinstance(function, type) and dataclasses.is_dataclass(function):
        return {f.name: getattr(frame.f_locals["self"], f.name) for f in dataclasses.fields(function) if f.init}
    code = frame.f_code
    count = code.co_argcount + code.co_kwonlyargcount
    count += bool(code.co_flags & inspect.CO_VARARGS) + bool(code.co_flags & inspect.CO_VARKEYWORDS)
    names = code.co_varnames[:count]
    if isinstance(function, type | types.MethodType):
        names = names[1:]
    return {name: frame.f_locals[name] for name in names}


def _size(value, depth=0):
    """Numbers in an argument, those that its parts hold among them."""
    if isinstance(value, np.ndarray):
        return value.size
    if depth > 3 or isinstance(value, str | type | types.FunctionType | types.ModuleType):
        return 0
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else None
    return sum(_size(part, depth + 1) for part in (getattr(value, "__dict__", {}).values() if parts is None else parts))


def _form(value):
    """What tells one recorded argument from another: kind and shape."""
    return np.shape(value) if is_numeric(value) else value if isinstance(value, str | None) else type(value).__name__


def call(function, arguments):
    """Call with arguments by name."""
    signature = inspect.signature(function)
    positional, named = [], {}
    for name, parameter in signature.parameters.items():
        if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            positional.append(arguments[name])
        elif parameter.kind == parameter.VAR_POSITIONAL:
            positional.extend(arguments[name])
        elif parameter.kind == parameter.KEYWORD_ONLY:
            named[name] = arguments[name]
        else:
            named.update(arguments[name])
    return function(*positional, **named)


# --- one call --------------------------------------------------------------------------------------------------------


def spoilt(name, number, records, seed):
    """(arguments, whether they are extreme) of one call; the first calls are the recorded ones."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), number])
    arguments = copy.deepcopy(records[number % len(records)])
    names = [n for n in arguments if n != "self"] if number >= len(records) else []
    extreme = rng.random() < 0.15
    for _ in range(rng.choice([1, 1, 1, 2, 3]) if names else 0):
        chosen = names[rng.integers(len(names))]
        single = [n for n in names if n not in ("args", "kwargs", "options")]
        if chosen in single and rng.random() < 0.05:
            other = single[rng.integers(len(single))]
            arguments[chosen], arguments[other] = arguments[other], arguments[chosen]
        elif isinstance(arguments[chosen], tuple | dict) and chosen in ("args", "kwargs", "options"):
            arguments[chosen] = type(arguments[chosen])(arguments[chosen])
        else:
            arguments[chosen] = spoil(arguments[chosen], rng, extreme)
    counts = {n for n, v in records[number % len(records)].items() if _is_count(v)}
    return arguments, extreme or any(_is_extreme(v, n in counts) for n, v in arguments.items() if n != "self")


def _is_count(value):
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _is_extreme(value, count=False):
    if _is_count(value) or (count and isinstance(value, float)):
        return abs(value) > LARGEST_COUNT
    if is_numeric(value):
        array = np.abs(np.asarray(value, dtype=float))
        largest = array[np.isfinite(array)].max(initial=0.0)
        return bool(largest > LARGEST or 0 < largest < SMALLEST)
    if isinstance(value, list | tuple | dict):
        return any(map(_is_extreme, value.values() if isinstance(value, dict) else value))
    return False


def outcome_of(name, function, arguments, records):
    """(outcome, whether something was warned of, a line that tells more)."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                result = call(function, arguments)
                where = first_not_finite(result, name.rpartition(".")[2])
            outcome, more = ("NaN or inf" if where else "finite"), where
        except Hang:
            outcome, more = "hang", f"more than {SECONDS:g} s"
        except (Exception, SystemExit) as error:
            outcome, more = _kind_of(error, arguments), f"{type(error).__name__}: {error}"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    if outcome == "NaN or inf" and says_nan(function, type(result)):
        outcome = "NaN as documented"
    if outcome == "foreign" and functions_in(arguments) - set().union(*map(functions_in, records)):
        outcome = "caller's function"
    warned = [w for w in warned if not issubclass(w.category, ResourceWarning)]
    return outcome, str(warned[0].message) if warned else "", " ".join(more.split())[:200]


def functions_in(arguments):
    """{(parameter, function)} of a call; one that was recorded in no call takes or returns something else."""
    found = set()
    for name, value in arguments.items():
        if isinstance(value, dict):
            found |= {(name, function) for _, function in functions_in(value)}
        elif callable(value) and name != "self":
            function = getattr(value, "__func__", value)
            found.add((name, function if isinstance(function, FUNCTIONS) else type(function)))
    return found


def says_nan(function, kind):
    """Whether the docstring, or that of the result's class, says that a result may hold NaN or an infinity."""
    owner = getattr(sys.modules[function.__module__], function.__qualname__.partition(".")[0])
    said = " ".join(text for text in (function.__doc__, owner.__doc__, kind.__doc__) if text)
    return bool(re.search(r"\bNaN\b|\binf(inity|inities|inite)?\b", said, re.IGNORECASE))


def first_not_finite(value, path, depth=0):
    """Where in a result, its properties among them, NaN or an infinity stands; empty when nowhere."""
    if depth > 5 or isinstance(value, str | bytes | type | None) or callable(value):
        return ""
    if isinstance(value, types.GeneratorType):
        value = [item for item, _ in zip(value, range(3))]
    if isinstance(value, float | complex | np.ndarray | np.number):
        array = np.asarray(value)
        return path if array.dtype.kind in "fc" and not np.isfinite(array).all() else ""
    if isinstance(value, list | tuple | dict):
        items = value.items() if isinstance(value, dict) else enumerate(value)
    elif type(value).__module__.startswith("labkit."):
        names = [n for n, v in inspect.getmembers(type(value)) if isinstance(v, property) or hasattr(v, "attrname")]
        names += [f.name for f in dataclasses.fields(value)] if dataclasses.is_dataclass(value) else []
        items = ((n, getattr(value, n)) for n in names if not n.startswith("_"))
    else:
        return ""
    return next((found for key, item in items if (found := first_not_finite(item, f"{path}.{key}", depth + 1))), "")


def _kind_of(error, arguments):
    """Whether an error is a sentence of labkit's own, of the caller's function, or foreign."""
    handed = [
        f for _, f in functions_in(arguments) if not getattr(f, "__module__", None) or "labkit" not in f.__module__
    ]
    codes = {getattr(inspect.unwrap(function), "__code__", None) for function in handed}
    if any(frame.f_code in codes for frame, _ in traceback.walk_tb(error.__traceback__)):
        return "caller's function"
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "/bench/fuzz" not in f.filename]
    if any(f.filename.startswith(str(ROOT / "tests")) for f in frames):
        return "caller's function"
    if isinstance(error, OSError) and error.filename is not None:
        return "file"
    if not frames or not frames[-1].filename.startswith(str(Path(labkit.__file__).parent)):
        return "foreign"
    raised = linecache.getline(frames[-1].filename, frames[-1].lineno).strip().startswith("raise")
    one_sentence = isinstance(error, ValueError) and str(error).strip() and "\n" not in str(error)
    return "refused" if raised and one_sentence else "foreign"


# --- many calls ------------------------------------------------------------------------------------------------------


def work(pipe, name, function, records, numbers, seed):
    """Make the calls of these numbers, in a process of its own; tell each outcome before the next begins."""
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    signal.signal(signal.SIGPROF, _ring)
    gc.freeze()
    for number in numbers:
        arguments, extreme = spoilt(name, number, records, seed)
        pipe.send((number, extreme, None))
        resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time() + 3 * SECONDS), resource.RLIM_INFINITY))
        pipe.send((number, extreme, outcome_of(name, function, arguments, records)))
    pipe.close()


def _ring(*_):
    raise Hang


def run(name, function, records, calls, seed):
    """Yield (number, extreme, (outcome, warned, more)) of every call; a process that is stuck or dies is replaced."""
    todo, context = list(range(calls)), multiprocessing.get_context("fork")
    while todo:
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=work, args=(theirs, name, function, records, todo, seed), daemon=True)
        process.start()
        theirs.close()
        begun = (-1, False)
        try:
            while ours.poll(PATIENCE):
                number, extreme, told = ours.recv()
                begun = (number, extreme)
                if told:
                    todo.remove(number)
                    yield number, extreme, told
            raise RuntimeError(f"{name}: call {begun[0]} neither ends nor computes")
        except EOFError:
            if todo and begun[0] not in todo:
                raise RuntimeError(f"{name}: call {todo[0]} could not be made up") from None
            if todo:
                process.join()
                stuck = process.exitcode == -signal.SIGXCPU
                yield *begun, ("hang" if stuck else "foreign", "", f"the process ended with {process.exitcode}")
                todo.remove(begun[0])
        process.kill()
        process.join()


def table(counts):
    """Markdown: a row a module, ordinary magnitude first."""
    lines = []
    for extreme, title in ((False, "ordinary magnitude"), (True, "extreme")):
        lines += [
            f"\n| {title} | calls | {' | '.join(OUTCOMES)} | with a warning |",
            f"| --- {'| ---: ' * (len(OUTCOMES) + 2)}|",
        ]
        modules = sorted({module for module, e, _ in counts if e == extreme})
        for module in [*modules, "all"]:
            row = [sum(n for (m, e, o), n in counts.items() if e == extreme and o == outcome and module in (m, "all"))
                   for outcome in (*OUTCOMES, "warned")]  # fmt: skip
            lines.append(f"| {module} | {sum(row[:-1])} | {' | '.join(map(str, row))} |")
    return "\n".join(lines)


# --- what is none ----------------------------------------------------------------------------------------------------

SHEAR = np.eye(3) + 0.2 * np.eye(3, k=1)


def impostors(name, value):
    """(kind, what, value): what could stand for a transform, a rotation or a covariance and is none."""
    if not is_numeric(value):
        return
    array = np.array(value, dtype=float)
    n = array.shape[-1] if array.ndim > 1 and array.size else 0
    with contextlib.suppress(ValueError):
        if n and name.startswith("cov"):
            checks.as_covariances(array, name, n)
            size = 1.0 + np.abs(array).max()
            yield "covariance", "a negative", array - 2 * size * np.eye(n)
            if n > 1:
                yield "covariance", "an asymmetric", array + size * np.eye(n, k=1)
                yield "covariance", "an indefinite", array * np.eye(n) + 2 * size * (1 - np.eye(n))
        elif n in (3, 4):
            (checks.as_transforms if n == 4 else checks.as_rotations)(array, name)
            R = array[..., :3, :3]
            for what, instead in (("a sheared", R @ SHEAR), ("a left-handed", -R), ("a constant", 5 + 0 * R)):
                spoilt = array.copy()
                spoilt[..., :3, :3] = instead
                yield "rotation", what, spoilt


def accepted(chosen, records):
    """How many arguments that are a transform, a rotation or a covariance may be none, and which, in Markdown."""
    tried = {}
    for name, function in chosen.items():
        for arguments in records[name]:
            for key, value in arguments.items():
                for kind, what, instead in impostors(key, value) if key != "self" else ():
                    told = outcome_of(name, function, copy.deepcopy(arguments) | {key: instead}, records[name])
                    tried.setdefault((name, key, kind, what), (told[0], told[2]))
    lines = ["\n| in place of | arguments | refused |", "| --- | ---: | ---: |"]
    for kind in ("rotation", "covariance"):
        found = [outcome for (*_, k, _), (outcome, _) in tried.items() if k == kind]
        lines.append(f"| a {kind} | {len(found)} | {found.count('refused')} |")
    let_through = {place: told for place, told in tried.items() if told[0] != "refused"}
    return "\n".join(
        [*lines, "", *(f"{n}({k}): {w} {kind}: {' '.join(o)}" for (n, k, kind, w), o in let_through.items())]
    )


# --- the command -----------------------------------------------------------------------------------------------------


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*")
    parser.add_argument("--calls", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--examples", action="store_true", help="one of each wrong outcome; extreme ones are marked")
    asked = parser.parse_args()
    what, _, one = ",".join(asked.what).partition(":")
    wanted = tuple(what.split(",")) if what else ("",)
    functions = public()
    rooms = [room for room in ROOMS if any(w.split(".")[0] in (room, "") for w in wanted)]
    scratch = tempfile.TemporaryDirectory()
    records = record(functions, rooms, f"{scratch.name}/tests")
    chosen = {n: f for n, f in functions.values() if n in records and n.startswith(wanted)}
    signal.signal(signal.SIGPROF, _ring)
    if one:
        return show(what, chosen[what], records[what], int(one), asked.seed)
    begun, counts, examples = time.monotonic(), Counter(), set()
    for name, function in chosen.items():
        calls = -(-asked.calls // len(chosen))
        for number, extreme, (outcome, warned, more) in run(name, function, records[name], calls, asked.seed):
            module = ".".join(name.split(".")[:2])
            counts[module, extreme, outcome] += 1
            counts[module, extreme, "warned"] += bool(warned)
            if outcome not in RIGHT or (warned and not extreme):
                told = more if outcome not in RIGHT else f"warned: {warned}"
                kind = f"extreme, {outcome}" if extreme else outcome
                like = (name, kind, re.sub(r"[\d.]+", "", told)[:40])
                if asked.examples and like not in examples:
                    print(f"{name}:{number} {kind}: {told}", flush=True)
                examples.add(like)
    missing = sorted({n for n, _ in functions.values() if n.split(".")[0] in rooms} - set(records))
    print(f"\n{len(chosen)} functions and methods, {time.monotonic() - begun:.0f} s, seed {asked.seed}")
    print(f"Called by no test, and so not here: {', '.join(missing) or 'none'}")
    print(table(counts))
    print(accepted(chosen, records))


def show(name, function, records, number, seed):
    """One call with its traceback."""
    arguments, extreme = spoilt(name, number, records, seed)
    for key, value in arguments.items():
        print(f"{key} = {value!r}"[:600])
    print("extreme" if extreme else "ordinary", flush=True)
    result = call(function, arguments)
    print(result, first_not_finite(result, name))


if __name__ == "__main__":
    main()
