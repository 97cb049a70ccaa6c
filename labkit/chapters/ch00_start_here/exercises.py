"""Chapter 0: one playful exercise, to see how feedback works before it matters."""

import numpy as np

from ...exercises import metrics
from ...exercises.engine import Chapter, Exercise, Prediction
from ...exercises.outcome import Mistake


def quarter_turn(p):
    """The point p = (x, y) turned by +90 deg (counterclockwise) about the origin; (2,) -> (2,)."""
    return np.array([-p[1], p[0]])


CHAPTER = Chapter(
    "00-start-here",
    title="Start here",
    items=[
        Exercise(
            "quarter_turn",
            reference=quarter_turn,
            draw=lambda rng: (rng.uniform(1, 9, 2) * rng.choice([-1, 1], 2),),
            fixed={"p": "a point of the plane has two coordinates"},
            metric=metrics.Numbers(1e-9),
            hints=(
                "Draw the point (1, 0) and where it goes.",
                "(1, 0) goes to (0, 1), and (0, 1) goes to (-1, 0).",
                "`return np.array([-p[1], p[0]])`",
            ),
            mistakes=[
                Mistake(
                    lambda p: np.array([p[1], -p[0]]),
                    "You turn clockwise, by -90 deg. Counterclockwise, (1, 0) goes to (0, 1).",
                ),
                Mistake(
                    lambda p: p[::-1],
                    "You exchanged x and y. That is a mirror image in the diagonal, not a turn: one sign is missing.",
                ),
                Mistake(lambda p: -p, "You turn by 180 deg. A quarter turn also exchanges the components."),
                Mistake(
                    lambda p: np.array([-p[0], p[1]]),
                    "You mirrored the point in the y axis. A quarter turn exchanges the components.",
                ),
                Mistake(
                    lambda p: np.array([[np.cos(90), -np.sin(90)], [np.sin(90), np.cos(90)]]) @ p,
                    "np.cos and np.sin take radians: a quarter turn is np.pi / 2, not 90.",
                ),
                Mistake(
                    lambda p: np.array([p[0] - p[1], p[0] + p[1]]) / np.sqrt(2),
                    "You turn by 45 deg. A quarter of a full turn is 90 deg.",
                ),
                Mistake(
                    lambda p: np.array([p[0] + p[1], p[1] - p[0]]) / np.sqrt(2),
                    "You turn by 45 deg, and clockwise. A quarter of a full turn is 90 deg.",
                ),
                Mistake(
                    lambda p: np.array([p[0], -p[1]]),
                    "You mirrored the point in the x axis. A quarter turn exchanges the components.",
                ),
                Mistake(
                    lambda p: -p[::-1],
                    "Both signs are turned. That is a mirror image in the other diagonal: only the new x takes a minus.",
                ),
                Mistake(
                    lambda p: np.array([np.hypot(*p), np.arctan2(p[1], p[0]) + np.pi / 2]),
                    "These are distance and direction of the turned point. Return its coordinates x and y.",
                ),
                Mistake(lambda p: p, "You return the point as it came."),
            ],
        ),
        Prediction(
            "twice",
            question="You turn a point by a quarter turn, twice. Where does it end up?",
            choices=("where it was", "opposite, across the origin", "mirrored in the x axis"),
            answer="opposite, across the origin",
            why="Two quarter turns are a half turn: (x, y) becomes (-x, -y).",
        ),
    ],
)
