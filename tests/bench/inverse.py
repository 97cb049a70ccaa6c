"""What the lab sheet's pseudo-inverse costs beside the rigid inverse: `python tests/bench/inverse.py`."""

import timeit

import numpy as np

from labkit.geometry import frames


def by_transposing(T):
    """The student's solution, without checks."""
    X = np.eye(4)
    X[:3, :3] = T[:3, :3].T
    X[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return X


def best(function, T, number):
    return min(timeit.repeat(lambda: function(T), number=number, repeat=7)) / number


def main():
    rng = np.random.default_rng(0)
    xyzabc = np.c_[rng.normal(size=(10_000, 3)), rng.uniform(-1, 1, (10_000, 3))]
    many = frames.matrix_from_kuka(xyzabc)
    one = many[0]
    pinv, plain = best(np.linalg.pinv, one, 300), best(by_transposing, one, 300)
    print(f"one matrix:      pinv {1e6 * pinv:.1f} us, transposing {1e6 * plain:.1f} us, ratio {pinv / plain:.1f}")
    pinv, plain = best(np.linalg.pinv, many, 3), best(frames.invert, many, 3)
    print(f"10,000 matrices: pinv {1e3 * pinv:.1f} ms, frames.invert {1e3 * plain:.1f} ms, ratio {pinv / plain:.1f}")


if __name__ == "__main__":
    main()
