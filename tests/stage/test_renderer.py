"""Words, kept or drawn by matplotlib, and the colors of the dark theme, with and without matplotlib's private names."""

import gc
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends import backend_agg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.ft2font import FT2Font

from labkit.stage import renderer, style


def picture(canvas_class, dark):
    """Pixels of a figure with words, a line, markers and a collection."""
    fig = Figure((4, 2), dpi=100)
    canvas = canvas_class(fig)
    canvas.dark = dark
    with style.rc():
        fig.set(facecolor=style.PAPER)
        ax = style.axes(fig.subplots(), "x (mm)", "y (mm)")
        ax.plot([0, 1, 2], [0, 1, 0], **style.look("estimate"))
        ax.plot([0, 1], [1, 0], **style.look("measurement"))
        ax.scatter([0.5, 1.5], [0.2, 0.2], s=80, color=style.look("truth")["color"])
        canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].astype(float)


class Plain(renderer.Canvas):
    renderers = renderer.renderers(keep_words=False)


@pytest.mark.parametrize("dark", [False, True])
def test_without_private_names_the_picture_looks_the_same(dark):
    kept, plain = picture(renderer.Canvas, dark), picture(Plain, dark)
    paper = kept[0, 0]
    np.testing.assert_array_equal(plain[0, 0], paper)
    ink = np.abs(plain - paper).sum()
    assert np.abs(kept - paper).sum() == pytest.approx(ink, rel=0.1)
    assert (kept != plain).any(-1).mean() < 0.05  # words shifted by less than a pixel, nothing else


@pytest.mark.parametrize("canvas_class", [renderer.Canvas, Plain])
def test_dark_is_the_light_picture_with_every_color_exchanged(canvas_class):
    light, dark = picture(canvas_class, False), picture(canvas_class, True)
    compared = 0
    for rgb, other in style.DARK_RGB.items():
        here = (light == np.round(255 * np.array(rgb))).all(-1)
        if here.sum() > 100:  # fewer are no color but the rim of a letter, that happens to look like it
            exchanged = (np.abs(dark[here] - 255 * np.array(other)) <= 1).all(-1)
            assert exchanged.mean() > 0.95
            compared += here.sum()
    assert compared > 0.5 * light.shape[0] * light.shape[1]


@pytest.mark.parametrize("dark", [False, True])
def test_pixels_go_as_soon_as_they_are_forgotten(dark):
    """Without the collector: in a demo, what it is told to leave alone would hold them to the end."""
    fig = Figure((2, 1), dpi=100)
    canvas = renderer.Canvas(fig)
    canvas.dark = dark
    fig.text(0.1, 0.5, "words")
    canvas.draw()
    made = weakref.ref(canvas.renderer)
    gc.collect()
    gc.disable()
    try:
        canvas.forget()
        assert made() is None
    finally:
        gc.enable()


def test_this_release_can_keep_words():
    assert renderer.can_keep_words()
    assert renderer.Canvas.renderers == renderer.renderers(True)


class Renamed:
    """A renderer of a release that calls its font something else."""

    def __init__(self, width, height, dpi):
        self._renderer = backend_agg.RendererAgg(width, height, dpi)._renderer


class Hidden(backend_agg.RendererAgg):
    """A renderer of a release that keeps Agg somewhere else."""

    def __init__(self, *args):
        pass


@pytest.mark.parametrize(
    "backend, font",
    [
        (SimpleNamespace(RendererAgg=backend_agg.RendererAgg), FT2Font),
        (SimpleNamespace(RendererAgg=Renamed, get_hinting_flag=None), FT2Font),
        (SimpleNamespace(RendererAgg=Hidden, get_hinting_flag=None), FT2Font),
        (backend_agg, object),
    ],
)
def test_a_missing_private_name_is_found_out(backend, font):
    assert not renderer.can_keep_words(backend, font)


@pytest.mark.parametrize("size", [7.3, 10, 24])
def test_a_word_put_together_from_letters_is_the_one_the_font_sets(size):
    rng, kept = np.random.default_rng(3), renderer.Canvas(Figure(dpi=100)).get_renderer()
    signs = np.array([*"0123456789.-+e \N{MINUS SIGN}"])
    words = ["".join(rng.choice(signs, rng.integers(1, 9))) for _ in range(25)]
    letters = renderer._Letters(lambda: kept._prepare_font(FontProperties(size=size)))
    composed = 0
    for word in (*words, "P0, W; known to 0.12 mm", "Wave AV", "'~", "jf", " 1", "(T_WE) 30 \N{DEGREE SIGN}"):
        quick, own = letters.compose(word), letters.set(word)
        if quick is None:
            continue
        composed += 1
        assert quick[1:] == own[1:] and len(quick[0]) == len(own[0]), word
        common = min(quick[0].shape[1], own[0].shape[1])
        np.testing.assert_array_equal(quick[0][:, :common], own[0][:, :common], err_msg=word)
        assert not quick[0][:, common:].any() and not own[0][:, common:].any(), word
    assert composed >= len(words)
    assert letters.compose("") is letters.compose("\N{LATIN SMALL LETTER A WITH RING ABOVE}") is None
