"""Pages that need nothing but a browser: one file, offline, in light and dark, printable, with a view that turns.

A page is a title and sections of HTML; this module makes tables, charts by row as SVG, and the data of a 3D view that
the script in `report.html` draws on a canvas.
"""

import html
import json
from importlib import resources
from string import Template

import numpy as np

WIDTH, HEIGHT, LEFT, BOTTOM = 860, 190, 70, 30  # of a chart, in pixels
MAX_MARKS = 600  # of a chart, and as many rejected ones; more rows are thinned


def page(title, sections):
    """The text of a whole page from its title and sections of HTML."""
    template = Template(resources.files(__package__).joinpath("report.html").read_text(encoding="utf-8"))
    return template.safe_substitute(title=html.escape(title), body="\n".join(sections))


def section(heading, *parts):
    """A section with a heading, or nothing when there is nothing to show."""
    inside = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{html.escape(heading)}</h2>\n{inside}\n</section>" if inside else ""


def paragraphs(sentences, kind="", as_is=False):
    """Each sentence as a paragraph, of class `warning`, `advice` or `muted`; as_is leaves its first letter alone."""
    mark = f' class="{kind}"' if kind else ""
    return "\n".join(f"<p{mark}>{html.escape(s if as_is else upper(s))}</p>" for s in sentences)


def upper(sentence):
    """A sentence with its first letter large, ended by a full stop or what it ends with."""
    sentence = sentence[:1].upper() + sentence[1:]
    return sentence if sentence[-1:] in ".?!:" else sentence + "."


def table(head, rows, caption=""):
    """A table; numbers are shown with five digits."""
    cells = [[_cell(v) for v in row] for row in rows]
    body = "\n".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>" for row in cells)
    top = f"<caption>{html.escape(caption)}</caption>" if caption else ""
    titles = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    return f'<div class="wide"><table>{top}<thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(value):
    if isinstance(value, str):
        return html.escape(value)
    if isinstance(value, int):
        return str(value)
    return f"{float(value) + 0.0:.5g}" if np.isfinite(value) else "unknown"


def chart(values, kept, label, name="row", limit=None, alone=None):
    """Bars of one value a row, SVG: rejected rows as hollow crosses at the top edge where they leave the chart.

    values, kept: (n,). limit: a line that good rows rarely cross. alone: values under the fit to the other rows, drawn
    as rings.
    """
    values, kept = np.asarray(values, float), np.asarray(kept, bool)
    n = len(values)
    good = values[kept]
    top = 1.25 * max(np.max(good, initial=0.0), limit or 0.0, 1e-12)
    out = np.flatnonzero(~kept)
    out = out[:: max(len(out) // MAX_MARKS, 1)]
    rows = np.unique(np.concatenate([np.linspace(0, n - 1, min(n, MAX_MARKS)).astype(int), out]))
    across = lambda k: LEFT + (WIDTH - LEFT - 15) * (k + 0.5) / n  # noqa: E731
    up = lambda v: HEIGHT - BOTTOM - (HEIGHT - BOTTOM - 15) * min(v / top, 1.0)  # noqa: E731
    thick = max(1.0, min(14.0, 0.6 * (WIDTH - LEFT) / n))
    parts = [_axis(top, label, up)]
    for k in rows:
        x, y = across(k), up(values[k])
        what = f"<title>{name} {k + 1}: {values[k]:.4g}{'' if kept[k] else ', rejected'}</title>"
        if kept[k]:
            parts.append(
                f'<rect x="{x - thick / 2:.1f}" y="{y:.1f}" width="{thick:.1f}" '
                f'height="{HEIGHT - BOTTOM - y:.1f}" fill="var(--measurement)">{what}</rect>'
            )
            if alone is not None and np.isfinite(alone[k]) and n <= 120:
                parts.append(
                    f'<circle cx="{x:.1f}" cy="{up(alone[k]):.1f}" r="3.5" fill="none" stroke="var(--estimate)"/>'
                )
        else:
            parts.append(
                f'<path d="M{x - 5:.1f} {y - 5:.1f}l10 10m0 -10l-10 10" stroke="var(--muted)" stroke-width="2" '
                f'fill="none">{what}</path>'
            )
    if limit:
        parts.append(
            f'<path d="M{LEFT} {up(limit):.1f}H{WIDTH - 15}" stroke="var(--prediction)" stroke-dasharray="6 4"/>'
        )
    step = max(1, int(np.ceil(n / 12)))
    for k in range(0, n, step):
        parts.append(f'<text x="{across(k):.1f}" y="{HEIGHT - 12}" text-anchor="middle">{k + 1}</text>')
    return _svg(parts, f"{label} by {name}")


def curve(x, y, x_label, y_label):
    """A line through points, SVG; at most 600 of them, and none across a gap of the data."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    usual = np.median(np.diff(x)) if len(x) > 1 else 0.0
    pick = np.unique(np.linspace(0, len(x) - 1, min(len(x), MAX_MARKS)).astype(int))
    x, y = x[pick], y[pick]
    top, span = 1.1 * max(y.max(initial=0.0), 1e-12), max(np.ptp(x), 1e-12)
    up = lambda v: HEIGHT - BOTTOM - (HEIGHT - BOTTOM - 15) * v / top  # noqa: E731
    across = LEFT + (WIDTH - LEFT - 15) * (x - x[0]) / span
    far = np.concatenate([[True], np.diff(x) > 5 * max(usual, span / MAX_MARKS)])
    way = "".join(f"{'M' if new else 'L'}{a:.1f} {up(b):.1f}" for a, b, new in zip(across, y, far))
    parts = [_axis(top, y_label, up), f'<path d="{way}" fill="none" stroke="var(--estimate)" stroke-width="1.5"/>']
    for share, anchor in ((0, "start"), (0.5, "middle"), (1, "end")):
        place = LEFT + (WIDTH - LEFT - 15) * share
        number = f"{x[0] + share * span:.4g}"
        parts.append(f'<text x="{place:.1f}" y="{HEIGHT - 12}" text-anchor="{anchor}">{number}</text>')
    parts.append(f'<text x="{WIDTH - 15}" y="{HEIGHT + 3}" text-anchor="end" fill="var(--muted)">{x_label}</text>')
    return _svg(parts, f"{y_label} over {x_label}")


def _axis(top, label, up):
    ticks = [
        f'<path d="M{LEFT} {up(v):.1f}H{WIDTH - 15}" stroke="var(--line)"/>'
        f'<text x="{LEFT - 6}" y="{up(v) + 4:.1f}" text-anchor="end">{v:.3g}</text>'
        for v in (0.0, 0.4 * top, 0.8 * top)
    ]
    return "".join(ticks) + f'<text x="0" y="12" fill="var(--muted)">{html.escape(label)}</text>'


def _svg(parts, label):
    box = f'viewBox="0 0 {WIDTH} {HEIGHT + 4}" role="img" aria-label="{html.escape(label)}"'
    return f'<div class="wide"><svg {box}>{"".join(parts)}</svg></div>'


class View:
    """What a 3D view shows: lines and words, each with a role of the page's colors."""

    def __init__(self, above=False):
        self.lines, self.words, self.above = [], [], above

    def line(self, points, role, width=1.5, dash=None):
        """A polyline through points (n, 3)."""
        self.lines.append(
            {"points": np.round(points, 6).tolist(), "role": role, "width": width, **({"dash": dash} if dash else {})}
        )

    def frame(self, T, length, name="", width=1.5):
        """The three axes of a frame, and its name."""
        for k, role in enumerate("xyz"):
            self.line([T[:3, 3], T[:3, 3] + length * T[:3, k]], role, width)
        if name:
            self.word(T[:3, 3], name)

    def word(self, at, text, role="ink"):
        """A word at a point."""
        self.words.append({"at": np.round(at, 6).tolist(), "text": text, "role": role})

    def ellipsoid(self, center, covariance, scale, role="estimate"):
        """Three great ellipses of `scale` standard deviations."""
        values, vectors = np.linalg.eigh(covariance)
        half = vectors * np.sqrt(np.maximum(values, 0.0)) * scale
        angle = np.linspace(0, 2 * np.pi, 49)
        ring = np.stack([np.cos(angle), np.sin(angle)], 1)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            self.line(center + ring @ half[:, [a, b]].T, role)

    def as_html(self, label, hint="Drag to turn it, or click and use the arrow keys; + and - zoom."):
        """The canvas and its data."""
        every = np.concatenate([np.asarray(line["points"]) for line in self.lines])
        low, high = every.min(0), every.max(0)
        data = {
            "center": ((low + high) / 2).tolist(),
            "size": float(max(np.linalg.norm(high - low) / 2, 1e-9)),
            "lines": self.lines,
            "words": self.words,
            "above": self.above,
        }
        text = json.dumps(data).replace("</", "<\\/")
        return (
            f'<canvas tabindex="0" role="img" aria-label="{html.escape(label)}" data-scene="scene"></canvas>'
            f'<script type="application/json" id="scene">{text}</script><p class="muted hint">{hint}</p>'
        )
