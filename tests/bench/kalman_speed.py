"""Filters against the benchmark's units and against filterpy: `PYTHONPATH=. python tests/bench/kalman_speed.py`.

P is the time of 1000 products of two 3 x 3 arrays, taken right after the runs; ratios to P carry over between machines.
Goals: 0.5 P for 10,000 steps of a time-invariant filter, 8 P for 1000 EKF steps at 4 landmarks, 1e6 steps/s over 200
runs, agreement with filterpy to 1e-8 (compared where filterpy is installed).
"""

import time

import numpy as np
from peers_hooks import HOOKS

from labkit.localization import ekf

DT = 0.1
A3, B3 = np.random.default_rng(0).normal(size=(2, 3, 3))


def unit():
    for _ in range(1000):
        A3 @ B3


def best(call, of=3):
    """Shortest of some runs in seconds of processor time: what disturbs a run only makes it longer."""
    found = []
    for _ in range(of):
        start = time.process_time()
        call()
        found.append(time.process_time() - start)
    return min(found)


def measure(call, repeats=15):
    """Median (seconds, ratio to P) of a call."""
    call()
    pairs = [(best(call), best(unit)) for _ in range(repeats)]
    return np.median([(seconds, seconds / p) for seconds, p in pairs], axis=0)


def linear_case():
    rng, n = np.random.default_rng(4), 10_000
    F, H = np.array([[1, DT], [0, 1]]), np.array([[1.0, 0.0]])
    Q, R = 0.5 * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]]), np.array([[0.04]])
    z = (np.cumsum(rng.normal(size=n)) * 0.02 + 0.2 * rng.normal(size=n))[:, None]
    return F, Q, H, R, np.zeros(2), np.eye(2), z


def landmark_case(marks=4, runs=None):
    rng, n = np.random.default_rng(5), 1000
    landmarks, u = rng.uniform(-10, 10, (marks, 2)), np.tile([1.0, 0.2], (n, 1))
    cov_u = np.diag([0.01, 0.01])
    drive = ekf.simulate_drive(np.zeros(3), u, DT, cov_u, landmarks, 0.1, 0.02, rng, runs or 1)
    z = drive.z if runs else drive.z[:, 0]
    return u, z, landmarks, np.zeros(3), 0.1 * np.eye(3), np.diag([1e-4, 1e-4, 1e-5]), np.diag([0.01, 4e-4])


def filterpy_linear(F, Q, H, R, x0, P0, z):
    from filterpy.kalman import KalmanFilter

    f, out = KalmanFilter(2, 1), np.empty((len(z), 2))
    f.x, f.P, f.F, f.H, f.Q, f.R = x0[:, None].copy(), P0.copy(), F, H, Q, R
    for i in range(len(z)):
        f.predict()
        f.update(z[i])
        out[i] = f.x[:, 0]
    return out


def filterpy_landmarks(u, z, landmarks, x0, P0, Q, R):
    from filterpy.kalman import ExtendedKalmanFilter

    class Robot(ExtendedKalmanFilter):
        def predict_x(self, u=0):
            self.x = self.x + DT * np.array([u[0] * np.cos(self.x[2]), u[0] * np.sin(self.x[2]), u[1]])

    def residual(a, b):
        y = a - b
        y[1::2] = (y[1::2] + np.pi) % (2 * np.pi) - np.pi
        return y

    f, out = Robot(3, 2 * len(landmarks)), np.empty((len(z), 3))
    f.x, f.P, f.Q, f.R = x0.copy(), P0.copy(), Q, np.kron(np.eye(len(landmarks)), R)
    for i in range(len(z)):
        c, s = np.cos(f.x[2]), np.sin(f.x[2])
        f.F = np.array([[1, 0, -DT * u[i, 0] * s], [0, 1, DT * u[i, 0] * c], [0, 0, 1]])
        f.predict(u[i])
        f.update(
            z[i].ravel(), lambda x: ekf.measurement_jacobian(x, landmarks).reshape(-1, 3),
            lambda x: ekf.measurement(x, landmarks).ravel(), residual=residual,
        )  # fmt: skip
        out[i] = f.x
    return out


def main():
    linear, single, many = linear_case(), landmark_case(), landmark_case(runs=200)
    _, ratio = measure(lambda: HOOKS["kalman"](*linear))
    print(f"time-invariant filter, 10,000 steps: {ratio:.2f} P (goal 0.5)")
    _, ratio = measure(lambda: HOOKS["ekf"](*single))
    print(f"EKF, 1000 steps, 4 landmarks: {ratio:.1f} P (goal 8)")
    seconds, ratio = measure(lambda: HOOKS["ekf"](*many), repeats=5)
    print(f"EKF, 1000 steps, 200 runs: {200 * 1000 / seconds:.2e} steps/s (goal 1e6), {ratio:.0f} P")
    try:
        gaps = (
            np.abs(HOOKS["kalman"](*linear) - filterpy_linear(*linear)).max(),
            np.abs(HOOKS["ekf"](*single) - filterpy_landmarks(*single)).max(),
        )
        print(f"largest difference from filterpy: linear {gaps[0]:.1e}, EKF {gaps[1]:.1e} (goal 1e-8)")
    except ModuleNotFoundError:
        print("filterpy is not installed: no comparison")


if __name__ == "__main__":
    main()
