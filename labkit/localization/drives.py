"""Drives to simulate: routes on a topological map, robots that follow them, and what their odometry reports."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ..checks import as_choice, as_items, as_names, as_points, as_positive_number, as_shape, as_size
from ..documented import documented
from ..geometry.planar import wrap_angle
from . import odometry


def find_route(edges, start, goal):
    """Shortest way through a topological map, breadth first.

    Parameters
    ----------
    edges : sequence of pairs of names
    start, goal : name

    Returns
    -------
    list of names, from start to goal

    Raises
    ------
    ValueError
        When no chain of edges connects them.

    Source: lecture, "topologische Karten".
    """
    edges = as_items(edges, "edges", "pairs of names")
    if not all(isinstance(edge, (tuple, list)) and len(edge) == 2 for edge in edges):
        raise ValueError("edges must be pairs of names")
    as_names((start, goal, *(name for edge in edges for name in edge)), "places")
    before, queue = {start: None}, deque([start])
    while queue and goal not in before:
        here = queue.popleft()
        for a, b in edges:
            for one, other in ((a, b), (b, a)):
                if one == here and other not in before:
                    before[other] = here
                    queue.append(other)
    if goal not in before:
        raise ValueError(f"edges must connect {start!r} with {goal!r}, but no chain of edges does")
    route = [goal]
    while before[route[-1]] is not None:
        route.append(before[route[-1]])
    return route[::-1]


@dataclass(frozen=True, eq=False)
class Drive:
    """A simulated drive.

    Attributes
    ----------
    truth : array, shape (n + 1, 3)
        True poses (m, m, rad).
    controls : array, shape (n, 2)
        What odometry reports, v and omega (m/s, rad/s).
    dt : float
        Time step (s).
    """

    truth: np.ndarray
    controls: np.ndarray
    dt: float


def follow(start, waypoints, n_steps, dt, speed=0.6, turn_rate=0.8):
    """Controls of a robot that turns toward each waypoint and drives there; it stands still at the end.

    Parameters
    ----------
    start : array-like, shape (3,)
        m, m, rad.
    waypoints : array-like, shape (k, 2)
        m.
    n_steps : int
    dt : float
        Time step (s).
    speed, turn_rate : float
        m/s and rad/s, never exceeded.

    Returns
    -------
    array, shape (n_steps, 2)
    """
    (x, y, theta), n_steps = as_shape(start, "start", 3), as_size(n_steps, "n_steps", at_least=0)
    named = ((dt, "dt"), (speed, "speed"), (turn_rate, "turn_rate"))
    dt, speed, turn_rate = (as_positive_number(value, name) for value, name in named)
    controls = []
    for goal_x, goal_y in as_points(waypoints, "waypoints", dim=2).reshape(-1, 2).tolist():
        if len(controls) >= n_steps:
            break
        way, heading = math.hypot(goal_x - x, goal_y - y), math.atan2(goal_y - y, goal_x - x)
        turn = float(wrap_angle(heading - theta))
        for amount, rate, unit in ((turn, turn_rate, (0, 1)), (way, speed, (1, 0))):
            n = math.ceil(abs(amount) / (rate * dt) - 1e-9)
            if n:
                controls += [(amount / (n * dt) * unit[0], amount / (n * dt) * unit[1])] * min(n, n_steps)
        x, y, theta = goal_x, goal_y, heading
    controls = (controls + [(0.0, 0.0)] * n_steps)[:n_steps]
    return np.array(controls).reshape(-1, 2)


@documented
def random_drive(building, noise, n_steps, rng, dt=0.5, start=None):
    """A `Drive` from room to room of a building, in a random order.

    Parameters
    ----------
    building : Building
        With `nodes` and `edges`; doors and corridors are passed, never a goal.
    noise : dict
        k_d, k_theta, k_drift of what odometry reports, as for `odometry.control_covariance`.
    n_steps : int
    rng : numpy.random.Generator
    dt : float
        Time step (s).
    start : str, optional
        Name of the first node, random when not given.

    Returns
    -------
    Drive

    Raises
    ------
    ValueError
        Another noise than these three.
    """
    if set(noise) != {"k_d", "k_theta", "k_drift"}:
        raise ValueError(f"noise must hold k_d, k_theta and k_drift, got {', '.join(map(str, noise)) or 'none'}")
    rooms = [name for name in building.nodes if not name.startswith(("door", "corridor"))]
    here = rooms[rng.integers(len(rooms))] if start is None else as_choice(start, "start", building.nodes)
    xy = np.array(building.nodes[here])
    pose = np.array([*xy, rng.uniform(-np.pi, np.pi)])
    waypoints, enough = [], as_size(np.ceil(2 * n_steps * dt), "2 n_steps dt", at_least=0)  # more than can be reached
    while len(waypoints) < enough:
        goal = rooms[rng.integers(len(rooms))]
        if goal != here:
            waypoints += [building.nodes[name] for name in find_route(building.edges, here, goal)[1:]]
            here = goal
    controls = follow(pose, waypoints, n_steps, dt)
    truth = odometry.drive(pose, controls, dt)
    return Drive(truth, odometry.noisy_controls(controls, dt, **noise, rng=rng, runs=1)[:, 0], dt)


class Wanderer:
    """A robot that goes on from place to place of a topological map, from wherever it is put.

    Parameters
    ----------
    building : Building
        With `nodes`, `edges` and `grid`.
    rng : numpy.random.Generator
    """

    def __init__(self, building, rng):
        self.building, self.rng, self.at, self.goal = building, rng, None, None

    def start_over(self):
        """Forget where it was heading: it has been carried away."""
        self.at = self.goal = None

    @documented
    def control(self, pose, dt, speed=0.6, turn_rate=0.8):
        """The control for the next step, shape (2,): it turns toward the place it is heading for, then drives there.

        Parameters
        ----------
        pose : array-like, shape (3,)
            m, m, rad.
        dt : float
            Time step (s).
        speed, turn_rate : float
            m/s and rad/s.
        """
        pose, dt = as_shape(pose, "pose", 3), as_positive_number(dt, "dt")
        speed, turn_rate = as_positive_number(speed, "speed"), as_positive_number(turn_rate, "turn_rate")
        if self.goal is None:
            self.goal = self._in_sight(pose)
        if self.goal is None:
            return np.array([0.0, turn_rate / 2])
        way = np.subtract(self.building.nodes[self.goal], pose[:2])
        if np.hypot(*way) < 0.02:
            self.at, self.goal = self.goal, self._next()
            way = np.subtract(self.building.nodes[self.goal], pose[:2])
        turn = float(wrap_angle(np.arctan2(way[1], way[0]) - pose[2]))
        if abs(turn) > 0.02:
            return np.array([0.0, np.clip(turn / dt, -turn_rate, turn_rate)])
        return np.array([min(speed, np.hypot(*way) / dt), 0.0])

    def _next(self):
        neighbors = [b if a == self.goal else a for a, b in self.building.edges if self.goal in (a, b)]
        onward = [name for name in neighbors if name != self.at] or neighbors
        return onward[self.rng.integers(len(onward))]

    def _in_sight(self, pose):
        names = list(self.building.nodes)
        ways = np.array([self.building.nodes[name] for name in names]) - pose[:2]
        distance, direction = np.hypot(*ways.T), np.arctan2(ways[:, 1], ways[:, 0])
        free = self.building.grid.cast((*pose[:2], 0.0), direction, 30.0) > distance
        return names[int(np.argmin(np.where(free, distance, np.inf)))] if free.any() else None
