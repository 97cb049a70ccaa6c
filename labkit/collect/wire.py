"""The border between two processes: plain data, JSON and arrays, never pickle.

What cannot cross as data crosses as what it is: a function becomes a `Remote` that calls back over the border, a
random generator its state (and comes back advanced), a dataclass of the library its fields. Anything else arrives as a
`Stranger` that knows the name of its type and nothing more.
"""

import contextlib
import dataclasses
import importlib
import inspect
import json
import os
import queue
import select
import signal
import struct
import threading
import time

import numpy as np

from ..exercises.guard import Abroad

LARGEST = 64 << 20  # bytes of one message
DEEPEST = 40  # containers within containers
LONGEST = 400  # characters of a name or an error that cross
NUMBERS = "biufc"  # kinds of array that cross as bytes
TYPES = {kind.__name__: kind for kind in (bool, int, float, complex, str, tuple, list, dict, *np.sctypeDict.values())}
RECORDS = tuple(
    f"labkit.{room}." for room in ("geometry", "estimation", "calibration", "machines", "localization", "documents")
)
PIECE = 1 << 16  # bytes read at once
ENDS, LATE, NOT_STARTED = "the other side of the border has gone", "time is up", "the worker did not start"


class BorderError(Exception):
    """A value that cannot cross, or a message that is none."""


class Gone(BorderError):
    """The other process has ended, says nothing, or says what makes no sense."""


class Unwound(BorderError):
    """What was asked for is no longer wanted: the call it belonged to has ended meanwhile."""


# --- values ---------------------------------------------------------------------------------------------------------


def encode(value, parcel, functions=None, depth=0):
    """JSON for a value; arrays go to `parcel`, a list of bytes, functions into `functions`, a list.

    Raises
    ------
    BorderError
        What is larger or deeper than a message may be.
    """
    if depth > DEEPEST:
        raise BorderError(f"lists within lists cross the border to a depth of {DEEPEST}")
    if sum(map(len, parcel)) > LARGEST:
        raise BorderError(f"a value crosses the border up to {LARGEST >> 20} MB")

    def inner(part):
        return encode(part, parcel, functions, depth + 1)

    if isinstance(value, np.ndarray):
        return _encode_array(value, parcel, inner)
    if isinstance(value, np.str_ | np.bytes_):
        value = value.item()
    if isinstance(value, np.generic):
        return {"scalar": _bytes_of(np.asarray(value), parcel)} if value.dtype.kind in NUMBERS else _stranger(value)
    if value is None or isinstance(value, bool | str):
        return {"plain": value if value is None or isinstance(value, bool) else str(value)}
    if isinstance(value, int):
        return {"plain": int(value)} if value.bit_length() < 8192 else _stranger(value)
    if isinstance(value, float):
        return {"plain": float(value)}
    if isinstance(value, complex):
        return {"complex": [value.real, value.imag]}
    if isinstance(value, bytes | bytearray):
        parcel.append(bytes(value))
        return {"bytes": len(parcel) - 1}
    if _is_record(type(value)):
        names = getattr(value, "_fields", None) or [field.name for field in dataclasses.fields(value) if field.init]
        fields = {name: inner(getattr(value, name)) for name in names}
        return {"record": [f"{type(value).__module__}:{type(value).__qualname__}", fields]}
    for kind in (tuple, list, set, frozenset):
        if isinstance(value, kind):
            return {kind.__name__: [inner(part) for part in value]}
    if isinstance(value, dict):
        return {"dict": [[inner(key), inner(part)] for key, part in value.items()]}
    if isinstance(value, np.random.Generator):
        return {"generator": [type(value.bit_generator).__name__, inner(value.bit_generator.state)]}
    return _encode_object(value, functions, inner)


def _encode_object(value, functions, inner):
    if value is ...:
        return {"dots": 0}
    if isinstance(value, type) and value in TYPES.values():
        return {"type": value.__name__}
    if inspect.isgenerator(value) or inspect.iscoroutine(value):
        return {"unfinished": type(value).__name__}
    for method in ("as_matrix", "toarray", "__array__"):
        if hasattr(value, method) and not isinstance(value, type):
            return inner(np.asarray(getattr(value, method)()))
    if callable(value) and functions is not None:
        functions.append(value)
        return {"function": [len(functions) - 1, _name_of(value), _parameters_of(value)]}
    return _stranger(value)


def _encode_array(array, parcel, inner):
    if array.dtype.kind in NUMBERS and array.nbytes <= LARGEST:
        return {"array": _bytes_of(array, parcel)}
    if array.nbytes > LARGEST:
        raise BorderError(
            f"a value crosses the border up to {LARGEST >> 20} MB, got an array of {array.nbytes >> 20} MB"
        )
    if array.dtype.kind in "OUS":
        return {"objects": [array.dtype.kind, list(array.shape), [inner(part) for part in array.ravel().tolist()]]}
    return _stranger(array)


def _bytes_of(array, parcel):
    parcel.append(np.ascontiguousarray(array).tobytes())
    return [array.dtype.str, list(array.shape), len(parcel) - 1]


def _stranger(value):
    return {"stranger": type(value).__name__[:LONGEST]}


def _name_of(function):
    return str(getattr(function, "__name__", type(function).__name__))[:LONGEST]


def _parameters_of(function):
    """Names of the positional parameters, as a message about an argument quotes them."""
    code = getattr(function, "__code__", None)
    count = getattr(code, "co_argcount", None)
    return [str(name)[:80] for name in code.co_varnames[:count]] if isinstance(count, int) else []


def decode(word, parcel, functions=None):
    """The value that `encode` was given; `functions(k, name, parameters)` makes what stands for the k-th function.

    Raises
    ------
    Exception
        Of any kind: what arrives may be nonsense, and nothing is taken on trust.
    """
    ((kind, content),) = word.items()

    def inner(part):
        return decode(part, parcel, functions)

    if kind == "plain":
        return content
    if kind == "array":
        return _array(content, parcel).copy()
    if kind == "scalar":
        return _array(content, parcel)[()]
    if kind in ("tuple", "list", "set", "frozenset"):
        return {"tuple": tuple, "list": list, "set": set, "frozenset": frozenset}[kind](map(inner, content))
    if kind == "dict":
        return {inner(key): inner(part) for key, part in content}
    if kind == "complex":
        return complex(*content)
    if kind == "bytes":
        return parcel[content]
    if kind == "dots":
        return ...
    if kind == "type":
        return TYPES[content]
    if kind == "generator":
        return _generator(content[0], inner(content[1]))
    if kind == "objects":
        return _objects(content, inner)
    if kind == "record":
        return _record(content[0], {name: inner(part) for name, part in content[1].items()})
    if kind == "function" and functions is not None:
        return functions(int(content[0]), _identifier(content[1]), [_identifier(name) for name in content[2]])
    if kind == "unfinished":
        return _unfinished(content)
    if kind == "stranger":
        return type(_identifier(content), (Stranger,), {})()
    raise BorderError(f"nothing is known of {str(kind)[:LONGEST]!r}")


class Stranger:
    """What could not cross the border; its type has the name that it had there."""

    __slots__ = ()


def _array(content, parcel):
    dtype, shape, k = content
    dtype = np.dtype(dtype)
    if dtype.kind not in NUMBERS or dtype.hasobject:
        raise BorderError(f"arrays of {dtype} do not cross")
    return np.frombuffer(parcel[k], dtype).reshape(shape)


def _objects(content, inner):
    kind, shape, parts = content
    if kind != "O":
        return np.array([inner(part) for part in parts], dtype=kind).reshape(shape)
    array = np.empty(len(parts), dtype=object)
    for k, part in enumerate(parts):
        array[k] = inner(part)
    return array.reshape(shape)


def _generator(name, state):
    if name not in ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"):
        raise BorderError(f"no random generator {str(name)[:LONGEST]!r} is known")
    bits = getattr(np.random, name)(0)
    bits.state = state
    return np.random.Generator(bits)


def _record(path, fields):
    module, _, name = path.partition(":")
    if not module.startswith(RECORDS):
        raise BorderError(f"no record {path[:LONGEST]!r} is known")
    kind = getattr(importlib.import_module(module), name)
    if not (isinstance(kind, type) and _is_record(kind)):
        raise BorderError(f"{path} is no record")
    return kind(**fields)


def _is_record(kind):
    """Whether a type is a dataclass or a named tuple of the library."""
    named = dataclasses.is_dataclass(kind) or (issubclass(kind, tuple) and hasattr(kind, "_fields"))
    return named and kind.__module__.startswith(RECORDS)


def _unfinished(kind):
    if kind == "coroutine":

        async def waits(): ...

        coroutine = waits()
        coroutine.close()
        return coroutine
    return (nothing for nothing in ())


def _identifier(name):
    name = str(name)[:80]
    return name if name.isidentifier() or name == "<lambda>" else "something"


# --- messages -------------------------------------------------------------------------------------------------------


class Line:
    """One end of the border. Either side asks; while it waits for the answer it serves what the other side asks.

    `serve(head, parcel)` answers a question: it returns the answer's (content, parcel). `patience` is how many seconds
    of silence this side bears; the processor time a call takes is limited where the call runs.
    """

    def __init__(self, reading, writing, serve, patience=None):
        self.reading, self.writing, self.serve = reading, writing, serve
        self.patience, self.until = patience, None
        self.asked, self.inbox, self.buffer = 0, [], bytearray()
        self.thread, self.broken = threading.get_ident(), ""
        self.pieces = None
        if patience is not None and os.name == "nt":  # pipes cannot be waited for with a time limit there
            self.pieces = queue.Queue(maxsize=256)
            threading.Thread(target=self._read_on, name="labkit pipe", daemon=True).start()

    def ask(self, head, parcel=()):
        """Send a question and wait for its answer: (content, parcel)."""
        if threading.get_ident() != self.thread:
            raise BorderError("an exercise is checked in the notebook itself, not in a thread of it")
        self.asked += 1
        number = self.asked
        self._send({**head, "asked": number}, parcel)
        while True:
            head, parcel = self._receive()
            if "answers" not in head:
                self.answer(head, parcel)
            elif head["answers"] == number:
                return head, parcel
            elif head["answers"] < number:  # of a call further out, which has ended: nobody waits for this any more
                self.inbox.insert(0, (head, parcel))
                raise Unwound("the call has ended meanwhile")

    def answer(self, head, parcel):
        """Serve one question of the other side."""
        content, parts = self.serve(head, parcel)
        self._send({**content, "answers": head["asked"]}, parts)

    def serve_all(self):
        """Serve until the other side has gone."""
        while True:
            head, parcel = self._receive()
            if "answers" not in head:
                self.answer(head, parcel)

    def _send(self, head, parcel):
        parts = [json.dumps(head).encode(), *parcel]
        data = struct.pack("<I", len(parts)) + b"".join(struct.pack("<Q", len(part)) for part in parts)
        with _undisturbed():
            whole = (data, *parts) if sum(map(len, parts)) > PIECE else (b"".join((data, *parts)),)
            for part in whole:
                view = memoryview(part)
                while view:
                    try:
                        view = view[os.write(self.writing, view) :]
                    except OSError:
                        raise Gone(ENDS) from None

    def _receive(self):
        with _undisturbed(), Abroad.waiting():
            try:
                if not self.inbox:
                    self.inbox.append(self._message())
            except Gone as gone:
                self.broken = str(gone)
                raise
        return self.inbox.pop(0)

    def _message(self):
        silent_at = time.monotonic() + self.patience if self.patience is not None else None
        (count,) = struct.unpack("<I", self._take(4, silent_at))
        if not 0 < count <= 4096:
            raise Gone("what came over the border is no message")
        sizes = struct.unpack(f"<{count}Q", self._take(8 * count, silent_at))
        if sum(sizes) > 2 * LARGEST:
            raise Gone(f"a message over the border was larger than {2 * LARGEST >> 20} MB")
        head, *parcel = (self._take(size, silent_at) for size in sizes)
        try:
            head = json.loads(head)
            known = isinstance(head, dict) and isinstance(head.get("answers", head.get("asked")), int)
        except (ValueError, RecursionError):
            known = False
        if not known:
            raise Gone("what came over the border is no message")
        return head, parcel

    def _take(self, count, silent_at):
        while len(self.buffer) < count:
            piece = os.read(self.reading, PIECE) if silent_at is None else self._next_piece(silent_at)
            if not piece:
                raise Gone(ENDS)
            self.buffer += piece
        taken = bytes(self.buffer[:count])
        del self.buffer[:count]
        return taken

    def _next_piece(self, silent_at):
        left = max(min(silent_at, self.until or silent_at) - time.monotonic(), 0.0)
        if self.pieces is None:
            if select.select([self.reading], [], [], left)[0]:
                return os.read(self.reading, PIECE)
            raise Gone(LATE)
        try:
            return self.pieces.get(timeout=left)
        except queue.Empty:
            raise Gone(LATE) from None

    def _read_on(self):
        piece = b" "
        while piece:
            try:
                piece = os.read(self.reading, PIECE)
            except OSError:
                piece = b""
            self.pieces.put(piece)


@contextlib.contextmanager
def _undisturbed():
    """No alarm rings in the middle of a message: half of one would be lost."""
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
