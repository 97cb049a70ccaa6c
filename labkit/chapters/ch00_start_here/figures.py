"""Chapter 0: a point and its quarter turns."""

import numpy as np

from ...stage import style

NAMES = ("p", "once", "twice")
BESIDE = np.array([1.1, 0.45])  # two names nearer than this, across and up, would be written over each other


def plane(ax):
    """An empty plane with both axes through the origin. Returns ax."""
    style.axes(ax, "x", "y", equal=True)
    ax.set(xlim=(-6, 6), ylim=(-4, 4))
    ax.axhline(0, **style.look("guide"))
    ax.axvline(0, **style.look("guide"))
    return ax


def turned_points(ax):
    """Arms from the origin to the point, its first and its second turn, with labels; the circle that any turn keeps to,
    and the place across the origin. Returns (lines, labels, circle, across).
    """
    looks = ("measurement", "prediction", "estimate")
    lines = [ax.plot([], [], **{**style.look(look, linestyle="-"), "marker": "o"})[0] for look in looks]
    labels = [ax.text(0, 0, text) for text in NAMES]
    (circle,) = ax.plot([], [], **style.look("guide"))
    (across,) = ax.plot([], [], **style.look("rejected", marker="o", markersize=10))
    return lines, labels, circle, across


def name_points(labels, points):
    """Put the names beyond their points; those that would meet are one: "p, twice"."""
    places = points * (1 + 0.35 / np.maximum(np.linalg.norm(points, axis=1), 1))[:, None]
    meet = (np.abs(places[:, None] - places) < BESIDE).all(axis=2)
    named = meet.argmax(axis=1)  # the first that each meets
    for k, (label, place) in enumerate(zip(labels, places)):
        label.set_position(place)
        label.set_horizontalalignment("left" if points[k, 0] >= 0 else "right")
        label.set_text(", ".join(name for name, first in zip(NAMES, named) if first == k))
