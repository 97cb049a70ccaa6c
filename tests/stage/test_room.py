"""A figure in places smaller than designed: its panels, its letters, what they must not cover."""

import numpy as np
import pytest

from labkit.stage import Stage, style
from labkit.stage.canvas import SMALLEST, Picture
from labkit.stage.room import FLATTEST, LEAST, LEGIBLE, Words

PHONE, PROJECTOR, OWN = (352, 430), (690, 210), (700, 900)


def picture(rows, columns, words="y (mm)", size=(7.0, 4.2)):
    def scene(fig):
        axes = fig.subplots(rows, columns, squeeze=False).ravel()
        for ax in axes:
            style.axes(ax, "x (mm)", words)
            ax.plot([0, 1], [0, 1], label="a line")
        return [], lambda state, result: None

    made = Picture(scene, size)
    made.draw()
    return made


def fitted(made, room):
    made.fit(*room, 1.0, False)
    made.draw()
    return [ax.get_window_extent() for ax in made.fig.axes]


def letters(made):
    """Their size as a share of the designed one."""
    return made.fig.dpi / 100


def test_panels_side_by_side_go_under_each_other_on_a_phone_and_come_back():
    made = picture(1, 2)
    designed = [box.bounds for box in fitted(made, OWN)]
    upper, lower = fitted(made, PHONE)
    assert upper.x0 == pytest.approx(lower.x0, abs=1) and upper.y0 > lower.y1
    assert min(upper.width, lower.width) > 0.7 * 352 and letters(made) == 1 and made.height == 430
    np.testing.assert_allclose([box.bounds for box in fitted(made, OWN)], designed, atol=0.5)


def test_two_columns_of_two_become_one_of_four_column_after_column():
    boxes = fitted(picture(2, 2, "y"), (352, 900))
    order = np.argsort([-box.y0 for box in boxes])
    assert order.tolist() == [0, 2, 1, 3]


def test_panels_under_each_other_go_side_by_side_where_it_is_low():
    made = picture(2, 1)
    left, right = fitted(made, PROJECTOR)
    assert left.x1 < right.x0 and left.y0 == pytest.approx(right.y0, abs=1)
    assert made.height == 210 and letters(made) == 1


def test_letters_are_the_largest_that_leave_the_words_apart():
    """Eighteen rows that fill the figure: they touch in a low place unless they become smaller."""

    def scene(fig):
        ax = style.bare(fig.subplots())
        for k in range(18):
            ax.text(0, k / 18, f"row {k}", fontsize=10)
        return [], lambda state, result: None

    made = Picture(scene, (7.0, 4.2))
    made.draw()
    assert Words(made.fig).crowded() == 0
    fitted(made, PROJECTOR)
    small = letters(made)
    assert 0.5 < small < 1 and Words(made.fig).crowded() == 0
    fitted(made, (690, 300))
    assert small < letters(made) <= 1 and Words(made.fig).crowded() == 0


def test_letters_stay_legible_in_the_lowest_place_which_scrolls_instead():
    """Eighteen rows of letters of 11 pixels need 18 times 9 pixels at least, and the place has 120."""

    def scene(fig):
        ax = style.bare(fig.subplots())
        for k in range(18):
            ax.text(0, k / 18, f"row {k}", fontsize=8)
        return [], lambda state, result: None

    made = Picture(scene, (7.0, 4.2))
    made.draw()
    for size in (1.0, 1.6):  # of the letters around, as in the window of a projector
        made.fit(690, 120, 1.0, False, letters=size)
        made.draw()
        assert 8 * made.fig.dpi / 72 >= SMALLEST - 0.01
        assert 120 < made.height <= 420 and Words(made.fig).crowded() == 0


def test_a_panel_that_is_wide_but_flat_does_not_fit():
    """It has its share of the picture, and yet its markers cover the words above."""
    made = picture(3, 1, "y")
    words, ax = Words(made.fig), made.fig.axes[0]
    assert words.fit()
    left, bottom, width, _ = ax.get_position().bounds
    ax.set_position([left, bottom, width, 1.05 * FLATTEST / 4.2])
    assert words.fit()
    ax.set_position([left, bottom, width, 0.95 * FLATTEST / 4.2])
    assert not words.fit() and (words._shares() > LEAST * words.shares).all()


def test_words_on_each_other_outside_and_a_legend_on_a_line_are_counted():
    made = picture(1, 1)
    ax, words = made.fig.axes[0], Words(made.fig)
    assert words.crowd == 0 and words.fit()
    one, other = ax.text(0.5, 0.2, "here"), ax.text(0.51, 0.2, "here too")
    assert words.crowded() == 1
    other.remove()
    one.set_position((3, 0.2))
    assert words.crowded() == 1  # it leaves the figure
    one.remove()
    ax.legend(loc="lower left")
    assert words.crowded() == 1  # the line begins there
    ax.legend(loc="upper left")
    assert words.crowded() == 0 and words.fit()
    ax.set_position([0.1, 0.1, 0.5, LEAST])
    assert not words.fit()  # less than LEAST of its share is left


def with_a_wide_legend():
    def scene(fig):
        for ax in fig.subplots(1, 2):
            style.axes(ax, "x (mm)", "y (mm)")
            for word in ("the robot itself", "its estimate", "what it scans", "not on the map"):
                ax.plot([0, 1], [0, 1], label=word)
        style.legend_above(fig.axes[0], ncols=4)
        return [], lambda state, result: None

    return Picture(scene, (12.0, 4.2))


def test_a_legend_wider_than_its_panel_takes_more_rows_in_a_small_place_and_has_its_columns_back():
    made = with_a_wide_legend()
    made.draw()
    legend = made.fig.axes[0].get_legend()
    at_first = [text.get_text() for text in legend.get_texts()]
    size = legend.get_window_extent().size
    upper, _ = fitted(made, PHONE)
    folded = legend.get_window_extent()
    assert folded.height > 1.5 * size[1] and folded.x1 <= made.fig.bbox.x1 and upper.width > 0.7 * 352
    assert letters(made) >= 0.85
    fitted(made, (1200, 900))
    np.testing.assert_allclose(legend.get_window_extent().size, size, atol=1)
    assert [text.get_text() for text in legend.get_texts()] == at_first


def test_letters_that_cannot_be_read_are_worse_than_a_legend_on_a_line():
    def scene(fig):
        ax = style.axes(fig.subplots(), "x (mm)", "y (mm)")
        ax.plot(np.linspace(-6, 6, 200), np.exp(-(np.linspace(-6, 6, 200) ** 2)), label="a bell with a long name")
        ax.legend(loc="upper right")
        return [], lambda state, result: None

    made = Picture(scene, (7.0, 4.2))
    made.draw()
    fitted(made, (240, 430))
    assert letters(made) >= LEGIBLE and Words(made.fig).covered() == 1
    fitted(made, (348, 430))  # letters of 0.7 would keep the legend off the bell
    assert letters(made) >= LEGIBLE


def test_long_names_of_axes_go_on_in_a_second_line_where_it_is_low():
    made = picture(1, 2, "closure distance of a loop of many links (mm)")
    for box in fitted(made, PROJECTOR):
        assert box.height > 0.5 * 210
    assert letters(made) == 1
    assert all("\n" in ax.yaxis.label._get_wrapped_text() for ax in made.fig.axes)


def test_three_panels_in_two_rows_go_side_by_side_where_it_is_low():
    def scene(fig):
        grid = fig.add_gridspec(2, 2, width_ratios=(3, 2))
        for place in (grid[0, 0], grid[1, 0], grid[:, 1]):
            style.axes(fig.add_subplot(place), "x (mm)", "y")
        return [], lambda state, result: None

    made = Picture(scene, (7.0, 4.2))
    made.draw()
    boxes = fitted(made, PROJECTOR)
    assert [box.y0 for box in boxes] == pytest.approx([boxes[0].y0] * 3, abs=1)
    assert boxes[0].x1 < boxes[1].x0 and boxes[1].x1 < boxes[2].x0 and letters(made) == 1


def test_two_rows_of_three_become_three_of_two_on_a_phone():
    boxes = fitted(picture(2, 3, "y"), PHONE)
    assert np.argsort([-box.y0 * 10 + box.x0 / 100 for box in boxes]).tolist() == [0, 1, 2, 3, 4, 5]
    assert boxes[0].y0 == pytest.approx(boxes[1].y0, abs=1) and boxes[1].y0 > boxes[2].y1


def test_two_words_in_one_line_stay_apart():
    made = picture(1, 1)
    ax, words = made.fig.axes[0], Words(made.fig)
    one = ax.text(0.1, 0.2, "occupancy grid", transform=ax.transAxes)
    end, _ = ax.transAxes.inverted().transform(one.get_window_extent().get_points()[1])
    other = ax.text(end + 0.002, 0.2, "lines", transform=ax.transAxes)
    assert words.crowded() == 1
    other.set_x(other.get_position()[0] + 0.05)
    assert words.crowded() == 0


def test_a_long_target_takes_two_lines_on_a_phone():
    stage = Stage(
        "long", scene=lambda fig: (fig.subplots() and [], lambda state, result: None), compute=lambda state: None,
        fail={},
    )  # fmt: skip
    stage._picture.head("the quick brown fox that jumps over the lazy dog, within 5 mm", False)
    head = stage._picture._heading
    heights = {}
    for room in (OWN, PHONE):
        fitted(stage._picture, room)
        heights[room] = head.get_window_extent().height
        assert head.get_window_extent().x1 <= stage._picture.width
    assert heights[PHONE] > 1.8 * heights[OWN]
