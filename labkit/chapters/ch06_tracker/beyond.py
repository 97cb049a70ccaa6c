"""Chapter 6, its parts beyond the core path: base stations, errors over speed, the whole cell; items of its chapter."""

import numpy as np

from ...exercises import metrics
from ...exercises.engine import Exercise, Mistake, Prediction
from ...geometry.frames import unit_vector
from ...machines import stations
from ...machines.accuracy import static_error_and_lag

# Base stations ---------------------------------------------------------------------------------------------------------------


def ray_direction(delays, rate):
    """Direction in which a station sees a diode that its planes hit so long after their flashes."""
    return stations.ray_direction(stations.sweep_angle(delays, rate))


def two_delays(rng):
    """Times after the flashes, s, of a diode that is off in both directions, and turns per second."""
    rate = float(rng.uniform(40, 120))
    return stations.sweep_delay(rng.uniform(0.3, 0.9, 2) * rng.choice([-1, 1], 2), rate), rate


def _direction(of, quarter=0.25, turns=1.0, unit=True):
    """A ray from the angles as another reading of them has it."""

    def variant(delays, rate):
        d = np.array(of(*(2 * np.pi * (turns * rate * delays - quarter))))
        return d / np.linalg.norm(d) if unit else d

    return variant


def _tangents(a, b):
    return np.tan(a), np.tan(b), 1.0


def rays(rng):
    """Rays that pass a point at some distance; their number varies, and their directions are of any length."""
    n = int(rng.integers(2, 6))
    place, origins = rng.uniform(-500, 500, 3), rng.uniform(-3000, 3000, (n, 3))
    directions = unit_vector(place - origins + rng.uniform(-30, 30, (n, 3)))
    return origins, directions * rng.uniform(0.3, 4, (n, 1))


def _normal_equations(block, right=None):
    """The point from sums of blocks of the rays' directions, of length 1 or as they come."""

    def variant(origins, directions):
        N = np.array([block(d) for d in directions])
        M = N if right is None else np.array([right(d) for d in directions])
        return np.linalg.lstsq(N.sum(0), (M @ origins[..., None]).sum(0)[:, 0], rcond=None)[0]

    return variant


def _along(d):
    return np.outer(d, d) / (d @ d)


def _across(d):
    return np.eye(3) - _along(d)


# Errors over speed -----------------------------------------------------------------------------------------------------------


def readings_in_motion(rng):
    """Speeds, mm/s, and errors, mm, of a motion whose tracker lags; the squares scatter about their line."""
    speed = rng.uniform(20, rng.uniform(900, 1800), int(rng.integers(30, 60)))
    squares = rng.uniform(3, 9) ** 2 + (rng.uniform(0.008, 0.03) * speed) ** 2
    return speed, np.sqrt(squares * (1 + 0.1 * rng.uniform(-1, 1, len(speed))))


def _line(x, y, end=lambda intercept, slope: (np.sqrt(intercept), np.sqrt(slope))):
    """Another line through other powers of speed and error; `end` makes the answer of its intercept and slope."""

    def variant(speed, error):
        slope, intercept = np.polyfit(x(speed), y(error), 1)
        return tuple(map(float, end(intercept, slope)))

    return variant


def _square(v):
    return v**2


STATIONS = [
    Prediction(
        "sweep",
        question="The plane of light turns 60 times a second. How far does it move in a microsecond, 3 m away (mm)?",
        answer=1.131,
        unit="mm",
        within=0.05,
        why="2 pi 60 rad/s times 1e-6 s times 3000 mm is 1.1 mm: a tracker of this kind measures times, and a time that is off by a microsecond is a millimeter.",
    ),
    Exercise(
        "ray_direction",
        reference=ray_direction,
        draw=two_delays,
        metric=metrics.Numbers(1e-9),
        fixed={"delays": "a station has two planes, so there are two delays"},
        hints=(
            "First the angles: a whole turn takes 1 / rate, and the plane starts a quarter of a turn before straight ahead. Then the ray: both planes hold it.",
            "alpha = atan2(x, z) and beta = atan2(y, z), so x / z and y / z are their tangents. Take z = 1, then the length 1.",
            "`angles = 2 * np.pi * rate * np.asarray(delays) - np.pi / 2\nd = np.append(np.tan(angles), 1.0)\nreturn d / np.linalg.norm(d)`",
        ),
        mistakes=[
            Mistake(
                _direction(_tangents, quarter=0.0),
                "The plane starts a quarter of a turn before straight ahead, at -90 deg: subtract pi / 2.",
                id="ray_direction-quarter",
            ),
            Mistake(
                _direction(_tangents, unit=False),
                "The direction is right, its length is not 1.",
                id="ray_direction-length",
            ),
            *(
                Mistake(
                    _direction(of),
                    "You take the angles as azimuth and elevation. They are not: each plane turns about its own axis, and "
                    "alpha = atan2(x, z), beta = atan2(y, z) both start from z.",
                    id=f"ray_direction-sphere-{k}",
                )
                for k, of in enumerate(
                    (
                        lambda a, b: (np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)),
                        lambda a, b: (np.sin(a), np.sin(b) * np.cos(a), np.cos(a) * np.cos(b)),
                    )
                )
            ),
            Mistake(
                _direction(lambda a, b: (np.sin(a), np.sin(b), 1.0)),
                "You put the sines beside z = 1. x / z and y / z are the tangents.",
                id="ray_direction-sines",
            ),
            Mistake(
                _direction(lambda a, b: (np.sin(a), np.sin(b), np.sqrt(max(0, 1 - np.sin(a) ** 2 - np.sin(b) ** 2)))),
                "You take the sines of the angles as the first two parts of the direction. The planes cut at x / z = tan alpha, y / z = tan beta.",
                id="ray_direction-cosines",
            ),
            Mistake(
                _direction(lambda a, b: (a, b, 1.0)),
                "You put the angles beside z = 1, which is right for small ones alone. x / z and y / z are their tangents.",
                id="ray_direction-small",
            ),
            Mistake(
                _direction(lambda a, b: (np.tan(b), np.tan(a), 1.0)),
                "The two have changed places: the first delay belongs to the plane that holds the y axis, and gives x.",
                id="ray_direction-swapped",
            ),
            Mistake(
                _direction(lambda a, b: (np.tan(-a), np.tan(-b), 1.0)),
                "The plane moves toward +x and +y as time passes: your angles have the opposite sign.",
                id="ray_direction-sign",
            ),
            Mistake(
                _direction(_tangents, turns=0.5),
                "The plane turns by 2 pi in 1 / rate; yours by pi.",
                id="ray_direction-half-a-turn",
            ),
            Mistake(
                _direction(lambda a, b: _tangents(np.rad2deg(a), np.rad2deg(b))),
                "np.tan wants radians.",
                id="ray_direction-degrees",
            ),
        ],
    ),
    Exercise(
        "nearest_to_rays",
        reference=stations.nearest_to_rays,
        draw=rays,
        metric=metrics.Numbers(1e-6, "mm"),
        hints=(
            "What of p - o is the distance to a ray through o? The part across its direction d. Make the sum of its squares least.",
            "With d of length 1 the part across is (I - d d^T)(p - o), and (I - d d^T) is its own square: sum (I - d d^T) p = sum (I - d d^T) o.",
            "`N, b = np.zeros((3, 3)), np.zeros(3)\n"
            "for o, d in zip(origins, directions):\n"
            "    across = np.eye(3) - np.outer(d, d) / (d @ d)\n"
            "    N, b = N + across, b + across @ o\n"
            "return np.linalg.solve(N, b)`",
        ),
        mistakes=[
            Mistake(
                _normal_equations(lambda d: np.eye(3) - np.outer(d, d)),
                "The directions are not of length 1 here: I - d d^T takes away the part along d only if they are.",
                id="nearest_to_rays-length",
            ),
            Mistake(
                _normal_equations(_along),
                "d d^T is the part along the ray, which may be as long as it likes. The distance is what remains, I - d d^T.",
                id="nearest_to_rays-along",
            ),
            Mistake(
                lambda origins, directions: np.mean(origins, axis=0),
                "This is the middle of the stations. The point lies where the rays meet.",
                id="nearest_to_rays-origins",
            ),
            Mistake(
                _normal_equations(_across, lambda d: np.eye(3)),
                "On the right side each origin counts with its part across the ray: (I - d d^T) o.",
                id="nearest_to_rays-right-side",
            ),
            Mistake(
                _normal_equations(_across, lambda d: -_across(d)),
                "The point is on the other side of the origin: sum (I - d d^T) p = + sum (I - d d^T) o.",
                id="nearest_to_rays-sign",
            ),
            Mistake(
                lambda origins, directions: (origins + directions).mean(0),
                "You went along each ray by the length of its direction, which says nothing. How far to go is what has to be found.",
                id="nearest_to_rays-one-step",
            ),
        ],
    ),
    Prediction(
        "moved",
        question="Somebody knocks a station by 0.1 deg, and the software does not know. When does that spoil the calibration more?",
        choices=("before the run begins", "after its tenth stop", "both alike"),
        answer="after its tenth stop",
        why="Before the run, nearly all of it is one rigid motion of the whole world, and W takes that up. In the middle there are two worlds, and no mounting fits both.",
    ),
]

SPEEDS = [
    Prediction(
        "tempo",
        question="The same path in half the time, and a tracker with a constant lag. By which factors do its errors of position and of speed grow?",
        choices=("2 and 2", "2 and 4", "4 and 4"),
        answer="2 and 4",
        why="The position is off by speed times lag, and the speed doubles. The speed is off by acceleration times lag, and the acceleration is four times as large.",
    ),
    Exercise(
        "static_error_and_lag",
        reference=static_error_and_lag,
        draw=readings_in_motion,
        metric=metrics.Several(metrics.Numbers(1e-6, "mm"), metrics.Numbers(1e-9, "s"), names=("e0", "lag")),
        hints=(
            "The law bends in speed and error. In which two quantities is it a straight line?",
            "error^2 against speed^2: the intercept is e0^2, the slope lag^2. Two unknowns, `np.polyfit` or `lstsq`.",
            "`slope, intercept = np.polyfit(speed**2, error**2, 1)\nreturn np.sqrt(intercept), np.sqrt(slope)`",
        ),
        mistakes=[
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(s), np.sqrt(i))),
                "The two have changed places: `np.polyfit` gives the slope first.",
                id="static_error_and_lag-swapped",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (i, s)),
                "These are e0^2 and lag^2, in mm^2 and s^2. Take the roots.",
                id="static_error_and_lag-squares",
            ),
            Mistake(
                _line(lambda v: v, lambda e: e, lambda i, s: (i, s)),
                "You laid a line through errors and speeds themselves, as if the errors simply added. Independent errors add as squares.",
                id="static_error_and_lag-plain",
            ),
            Mistake(
                _line(lambda v: v, _square, lambda i, s: (np.sqrt(max(i, 0)), np.sqrt(s))),
                "You squared the errors, but not the speeds: error^2 = e0^2 + lag^2 speed^2.",
                id="static_error_and_lag-speed",
            ),
            Mistake(
                _line(_square, lambda e: e, lambda i, s: (i, np.sqrt(s))),
                "You squared the speeds, but not the errors: error^2 = e0^2 + lag^2 speed^2.",
                id="static_error_and_lag-error",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(i), 1000 * np.sqrt(s))),
                "The lag is in milliseconds; wanted are seconds.",
                id="static_error_and_lag-milliseconds",
            ),
            Mistake(
                _line(_square, _square, lambda i, s: (np.sqrt(i), s)),
                "The slope is lag^2: take its root as well.",
                id="static_error_and_lag-root",
            ),
            Mistake(
                lambda speed, error: (0.0, float(np.sqrt((speed**2 @ error**2) / (speed**2 @ speed**2)))),
                "Your line passes through the origin: what is there at rest, e0, counts as lag.",
                id="static_error_and_lag-origin",
            ),
            Mistake(
                lambda speed, error: (float(error.min()), static_error_and_lag(speed, error)[1]),
                "The smallest error of all is the luckiest reading, not what stays at rest: take the intercept of the line.",
                id="static_error_and_lag-smallest",
            ),
        ],
    ),
]
