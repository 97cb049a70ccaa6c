"""What linear algebra returns comes back with its last bit stirred, as another processor would return it.

As a plugin of pytest, `pytest -p last_bits`, it stirs the unit tests; `python lab.py test --last-bits SEED` does so. In
a kernel, where `load_ipython_extension` is called, it stirs a notebook. LAST_BITS in the environment is the seed. The
same input gives the same output, as on any one processor: what differs between two seeds hangs on last bits.

Stirred are the functions whose results differ from one build of BLAS and LAPACK to the next, by one or two units in
the last place per entry, up, down or not at all; so is a 1 that every processor finds exactly, and a symmetric result
is so no more: nothing may hang on either. `@` stays as it is: it cannot be replaced from outside.
"""

import functools
import os
import zlib

import numpy as np
import scipy.linalg

STIRRED = (
    (np.linalg, "svd eigh eigvalsh eig eigvals qr solve inv pinv lstsq cholesky det norm multi_dot"),
    (scipy.linalg, "svd eigh eig qr solve inv lstsq cholesky cho_solve solve_triangular expm solve_discrete_are"),
    (np, "einsum dot vdot inner tensordot"),
)


@functools.cache
def factors(char, seed, size):
    """More than `size` numbers beside one, to stir results of that type: below, one itself and above by one unit."""
    one = np.array(1, dtype=char)
    beside = np.array([np.nextafter(one, 0 * one), one, np.nextafter(one, 2 * one)])
    return np.random.default_rng(seed).choice(beside, 2 * size + 4096)


def stirred(value, seed):
    """`value` with the entries of its float arrays moved by at most two units in the last place; zero stays zero."""
    if isinstance(value, np.floating):
        return stirred(np.asarray(value), seed)[()]
    if isinstance(value, np.ndarray) and value.dtype.kind == "c":
        return stirred(value.real, seed) + 1j * stirred(value.imag, seed)
    if isinstance(value, np.ndarray) and value.dtype.char in "fd":
        near_one = factors(value.dtype.char, seed, value.size)
        place = zlib.crc32(value.tobytes()) % (near_one.size - value.size + 1)
        return value * near_one[place : place + value.size].reshape(value.shape)
    if isinstance(value, tuple):
        parts = [stirred(part, seed) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def stirring(function, seed):
    """`function` whose results are stirred."""

    @functools.wraps(function)
    def stirred_function(*args, out=None, **kwargs):
        if out is None:
            return stirred(function(*args, **kwargs), seed)
        out[...] = stirred(function(*args, **kwargs), seed)
        return out

    return stirred_function


def install(seed):
    """Put the stirred functions in place of their originals, for as long as this process lives."""
    for module, names in STIRRED:
        for name in names.split():
            setattr(module, name, stirring(getattr(module, name), seed))


def load_ipython_extension(shell):
    """What IPython calls in a kernel: stirs when LAST_BITS asks for it."""
    if os.environ.get("LAST_BITS"):
        install(int(os.environ["LAST_BITS"]))


def pytest_configure(config):
    """What pytest calls before it imports a test."""
    install(int(os.environ.get("LAST_BITS", "1")))
