"""Chapter 0: a point and its quarter turns."""

from ...stage import style


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
    labels = [ax.text(0, 0, text) for text in ("p", "once", "twice")]
    (circle,) = ax.plot([], [], **style.look("guide"))
    (across,) = ax.plot([], [], **style.look("rejected", marker="o", markersize=10))
    return lines, labels, circle, across
