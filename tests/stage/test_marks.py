"""Small things that chapters draw."""

import pytest

from labkit.stage import style
from labkit.stage.canvas import Picture
from labkit.stage.marks import Readout


@pytest.mark.parametrize("has_legend", (False, True))
def test_lines_beside_a_picture_draw_together_before_letters_shrink(has_legend):
    found = []

    def scene(fig):
        left, right = fig.subplots(1, 2)
        style.axes(left, "x (mm)", "y (mm)")
        style.bare(right)
        if has_legend:
            right.plot([], [], label="a line")
            right.legend(loc="lower left")
        found.append(Readout(right))
        found[0].set_text("\n".join(f"joint {k}" for k in range(12)))
        return found, lambda state, result: None

    made = Picture(scene, (7.0, 4.2))
    for width, height in ((700, 420), (700, 280), (360, 400), (700, 420)):
        made.fit(width, height, 1.0, False)
        made.draw()
        (words,), panel = found, found[0].axes
        box, low = words.get_window_extent(), panel.get_legend().get_window_extent().y1 if has_legend else panel.bbox.y0
        assert made.fig.dpi == 100 and box.y0 >= low - 1 and box.y1 <= panel.bbox.y1
