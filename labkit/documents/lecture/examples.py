"""The lecture's examples, simulated: it shows them without their numbers.

Source: lecture "Lokalisierung"; data/monte_carlo.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...checks import as_count, as_covariances, as_number, as_shape
from ...estimation.kalman import predict, vehicle_model
from ...fast.sensors import SensorSuite
from ...localization import odometry
from ...localization.drives import Drive, follow, random_drive
from ...localization.ekf import ekf_localize, simulate_drive
from ...localization.maps import OccupancyGrid
from ...localization.mcl import MonteCarloLocalizer, localizer, record
from ...localization.particles import odometry_motion
from ...localization.sensors import see_landmarks, weigh_landmarks
from ...tables import DATA, read_table
from . import printed as lecture


def predict_vehicle(steps, dt, var_x0, var_v0, var_a, acceleration=1.0):
    """State and covariance of the lecture's vehicle after predictions from rest, none of them corrected.

    Parameters
    ----------
    steps : int
        Number of predictions.
    dt : float
        Time step (s).
    var_x0, var_v0, var_a : float
        Variances of the first position (m^2), the first velocity (m^2/s^2) and the acceleration (m^2/s^4).
    acceleration : float
        The commanded one (m/s^2).

    Returns
    -------
    x, cov : arrays, shapes (2,) and (2, 2)
    """
    A, B, _ = vehicle_model(dt)
    names = ("var_x0", "var_v0", "var_a", "acceleration")
    var_x0, var_v0, var_a, acceleration = map(as_number, (var_x0, var_v0, var_a, acceleration), names)
    x, cov = np.zeros(2), np.diag([var_x0, var_v0])
    for _ in range(as_count(steps, "steps", at_least=0)):
        x, cov = predict(x, cov, A, B, u=[acceleration], cov_u=[[var_a]])
    return x, cov


def simulate_vehicle(steps, dt, var_x0, var_v0, var_a, var_z, rng, acceleration=1.0):
    """One drive of the lecture's vehicle from rest, with noise in start, acceleration and measurement.

    Parameters
    ----------
    steps : int
        Number of time steps.
    dt : float
        Time step (s).
    var_x0, var_v0, var_a, var_z : float
        Variances of the first position (m^2) and velocity (m^2/s^2), of the acceleration (m^2/s^4) and of a measured
        position (m^2).
    rng : numpy.random.Generator
    acceleration : float
        The commanded one (m/s^2).

    Returns
    -------
    states, z : arrays, shapes (steps, 2) and (steps,)
        True position (m) and velocity (m/s) after each step, and the position measured there (m).
    """
    A, B, C = vehicle_model(dt)
    x = rng.standard_normal(2) * np.sqrt([var_x0, var_v0])
    states, z = [], []
    for _ in range(as_count(steps, "steps")):
        x = A @ x + B[:, 0] * (acceleration + math.sqrt(var_a) * rng.standard_normal())
        states.append(x)
        z.append(C[0] @ x + math.sqrt(var_z) * rng.standard_normal())
    return np.array(states), np.array(z)


def reconstruct_vehicle(cov, steps, dt):
    """Variances (var_x0, var_v0, var_a) with which so many uncorrected predictions lead to a covariance, (3,).

    The covariance is linear in the three and has three entries, so for every number of steps and every time step there
    is exactly one answer. It is possible only where none of the three is negative; steps and dt themselves remain free.

    Parameters
    ----------
    cov : array-like, shape (2, 2)
        Covariance of position and velocity that is to be explained.
    steps : int
        Number of predictions, at least 2.
    dt : float
        Time step (s).
    """
    cov, steps = as_shape(as_covariances(cov, "cov", 2), "cov", 2, 2), as_count(steps, "steps", at_least=2)
    basis = [predict_vehicle(steps, dt, *row)[1] for row in np.eye(3)]
    entries = np.array([[P[0, 0], P[0, 1], P[1, 1]] for P in basis]).T
    return np.linalg.solve(entries, [cov[0, 0], cov[0, 1], cov[1, 1]])


@dataclass(frozen=True, eq=False)
class Scenario:
    """A drive past landmarks with all its settings.

    Attributes
    ----------
    controls : array, shape (n, 2), m/s and rad/s
        Commands.
    dt : float, s
        Time step.
    cov_u : array, shape (2, 2)
        Noise of the control.
    landmarks : array, shape (m, 2), m
    std_range, std_bearing : float, m and rad
        Noise of the sensor.
    x0, cov0 : arrays, shapes (3,) and (3, 3)
        What is known of the start (m, m, rad).
    """

    controls: np.ndarray
    dt: float
    cov_u: np.ndarray
    landmarks: np.ndarray
    std_range: float
    std_bearing: float
    x0: np.ndarray
    cov0: np.ndarray

    def simulate(self, rng, runs, **more):
        """`SimulatedRuns`, each with its own start drawn from x0 and cov0; options as `simulate_drive`."""
        start = self.x0 + rng.standard_normal((runs, 3)) @ np.linalg.cholesky(self.cov0).T
        noise = (self.cov_u, self.landmarks, self.std_range, self.std_bearing)
        return simulate_drive(start, self.controls, self.dt, *noise, rng, runs, **more)

    def localize(self, drive, **changes):
        """`Localization` of what `simulate` drove, by a filter that believes the scenario but for the `changes`."""
        believed = {"cov_u": self.cov_u, "std_range": self.std_range, "std_bearing": self.std_bearing} | changes
        return ekf_localize(drive.controls, drive.z, self.landmarks, self.x0, self.cov0, self.dt, **believed)


def circle_course(marks=4, steps=300):
    """The lecture's circle of chapter 7 past one to four landmarks; sensor and start are ours.

    Parameters
    ----------
    marks, steps : int
        Number of landmarks, of time steps.

    Returns
    -------
    Scenario

    Source: lecture, "Beispielfahrt mit einer Landmarke", which shows such a drive without its numbers.
    """
    marks, steps, circle = as_count(marks, "marks"), as_count(steps, "steps"), lecture.circle_drive()
    cov_u = odometry.control_covariance(circle.controls[0], circle.dt, **circle.noise)
    landmarks = np.array([[5.0, 5.0], [-4.0, 5.5], [-4.5, -1.0], [4.5, -1.5]])[:marks]
    cov0 = np.diag([0.1**2, 0.1**2, np.radians(3) ** 2])
    controls = np.tile(circle.controls[0], (steps, 1))
    return Scenario(controls, circle.dt, cov_u, landmarks, 0.1, np.radians(1), np.zeros(3), cov0)


@dataclass(frozen=True, eq=False)
class Building:
    """One small building in the four forms of the lecture, in m.

    Attributes
    ----------
    lines : array, shape (n, 4)
        Walls.
    points : array, shape (m, 2)
        Obstacle points.
    nodes : dict
        {name: (x, y)}.
    edges : tuple
        Pairs of names.
    grid : OccupancyGrid
    landmarks : array, shape (k, 2)
    """

    lines: np.ndarray
    points: np.ndarray
    nodes: dict
    edges: tuple
    grid: OccupancyGrid
    landmarks: np.ndarray


def load_building():
    """The building of `data/monte_carlo`: 16 m by 10 m, synthetic."""
    walls = read_table("monte_carlo/building_lines.csv")
    points = read_table("monte_carlo/building_points.csv")
    nodes = read_table("monte_carlo/building_nodes.csv", text=("name",))
    edges = read_table("monte_carlo/building_edges.csv", text=("a", "b"))
    marks = read_table("monte_carlo/building_landmarks.csv")
    return Building(
        lines=np.column_stack([walls[key] for key in ("x1", "y1", "x2", "y2")]),
        points=np.column_stack([points["x"], points["y"]]),
        nodes={name: (x, y) for name, x, y in zip(nodes["name"].tolist(), nodes["x"], nodes["y"])},
        edges=tuple(zip(edges["a"].tolist(), edges["b"].tolist())),
        grid=OccupancyGrid.from_png(DATA / "monte_carlo/building.png", resolution=0.1),
        landmarks=np.column_stack([marks["x"], marks["y"]]),
    )


def global_example(building, n_particles=5000, n_steps=12, seed=5):
    """Global localization on the workbook's building, simulated: what the lecture shows in twelve pictures.

    Source: lecture, "Beispiel (1)" to "(12)".
    """
    rng, suite, noise = np.random.default_rng(seed), SensorSuite(building), lecture.example_noise()
    drive = random_drive(building, noise, n_steps, rng, start="hall")
    filter_ = localizer(building.grid, odometry_motion(**noise), n_particles, rng, recovery=False)
    return record(filter_, drive, lambda pose, k: suite.measure("likelihood field", pose, rng), rng)


@dataclass(frozen=True, eq=False)
class SoccerRun:
    """The lecture's soccer example, simulated; lengths in m.

    Attributes
    ----------
    landmarks : array, shape (6, 2)
    truth : array, shape (n + 1, 3)
    odometry : array, shape (n + 1, 3)
        The path that the controls alone give.
    estimates : array, shape (n, 3)
    seen : array of int, shape (n,)
        The landmark recognized at each step, or -1.
    pictures : list
        A `Picture` per step.
    """

    landmarks: np.ndarray
    truth: np.ndarray
    odometry: np.ndarray
    estimates: np.ndarray
    seen: np.ndarray
    pictures: list


def soccer_run(n_particles=1000, n_steps=120, seed=5, use=("range", "bearing")):
    """A robot with a camera drives over a soccer field and recognizes one of six landmarks at a time.

    The start is known. The camera looks 28 deg to either side and sees the nearest landmark within. Odometry has four
    times the variance of the lecture's example, as legs slip more than wheels.

    Parameters
    ----------
    n_particles, n_steps, seed : int
    use : tuple of str
        Which of "range" and "bearing" the filter may use; none leaves it to odometry.

    Returns
    -------
    SoccerRun

    Source: lecture, "Beispiel (1)" and "(2)" behind the landmark model; its data were never published.
    """
    rng = np.random.default_rng(seed)
    marks = read_table("monte_carlo/soccer_landmarks.csv")
    landmarks = np.column_stack([marks["x"], marks["y"]])
    corners = [(0.8, 0.6), (3.4, 0.6), (3.4, 2.1), (2.1, 1.35), (0.8, 2.1)] * 3
    dt, start = 0.4, np.array([0.8, 2.1, -math.pi / 2])
    std_range, std_bearing = 0.15, 0.08
    controls = follow(start, corners, n_steps, dt, speed=0.25, turn_rate=0.6)
    noise = {key: 4 * value for key, value in lecture.example_noise().items()}
    noisy = odometry.noisy_controls(controls, dt, **noise, rng=rng, runs=1)[:, 0]
    drive = Drive(odometry.drive(start, controls, dt), noisy, dt)

    seen = []

    def measure(pose, k):
        index, z = see_landmarks(None, pose, landmarks, rng, std_range, std_bearing)
        ahead = np.abs(z[:, 1]) < math.radians(28)
        if not ahead.any():
            seen.append(-1)
            return None
        nearest = np.flatnonzero(ahead)[np.argmin(z[ahead, 0])]
        seen.append(int(index[nearest]))
        stds = {f"std_{name}": std for name, std in (("range", std_range), ("bearing", std_bearing)) if name in use}
        if not stds:
            return None
        return weigh_landmarks(z[nearest : nearest + 1], landmarks[seen[-1] : seen[-1] + 1], **stds)

    cloud = start + rng.standard_normal((n_particles, 3)) * [0.1, 0.1, 0.1]
    pictures = record(MonteCarloLocalizer(cloud, odometry_motion(**noise)), drive, measure, rng)
    reckoned = odometry.drive(start, noisy, dt)
    estimates = np.array([picture.estimate for picture in pictures])
    return SoccerRun(landmarks, drive.truth, reckoned, estimates, np.array(seen), pictures)
