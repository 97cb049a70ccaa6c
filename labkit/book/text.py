"""Markdown as notebooks write it, as HTML: formulas become MathML, links to notebooks lead to their pages."""

import html
import re

import mistune
from latex2mathml.converter import convert
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer

FORMULA = r"\$(?!\s)(?P<formula_tex>(?:\\\$|[^$`])+?)(?<!\s)\$(?!\d)"
DISPLAYED = r"^ {0,3}\$\$(?P<displayed_tex>[\s\S]+?)\$\$[ \t]*$"
NOTEBOOK = re.compile(r"(?:\.\./notebooks/|\./)?(\d\d_\w+)\.ipynb")
ALIGNED = re.compile(r"\\(begin|end)\{aligned\}")
TRANSPOSED = "<mo>&#x022A4;</mo>"
EQUALS = "<mo>&#x0003D;</mo>"


def mathml(tex, block=False):
    """A formula in LaTeX as MathML; raises ValueError for one that holds a word it does not know."""
    known = ALIGNED.sub(r"\\\1{align*}", tex.strip())  # lines up the same; the converter prints the marks of the other
    made = convert(known, display="block" if block else "inline")
    unknown = re.search(r"\\[A-Za-z]+|(?<=>)&(?=<)", made)
    if unknown:
        raise ValueError(f"the formula {tex!r} holds {unknown[0]}, which MathML cannot be made of")
    made = made.replace(TRANSPOSED, TRANSPOSED.replace("mo>", "mi>"))  # a letter: a sign would stand far off
    return made if block else _breakable(made)


def _breakable(made):
    """A formula within a line as one for each side of its equal signs, so that the line can end before one."""
    head, inside, tail = re.fullmatch(r"(<math[^>]*>)(.*)(</math>)", made, re.DOTALL).groups()
    parts, start = [], 0
    for sign in re.finditer(re.escape(EQUALS), inside):
        before = inside[: sign.start()]
        depth = len(re.findall(r"<m\w+(?![^>]*/>)[^>]*>", before)) - before.count("</m")
        if depth == 1 and sign.start() > len("<mrow>"):  # in the outermost row, and not its first word
            parts.append(inside[start : sign.start()])
            start = sign.start()
    rows = [part.removeprefix("<mrow>") for part in [*parts, inside[start:].removesuffix("</mrow>")]]
    infix = EQUALS.replace("<mo>", '<mo form="infix">')
    return "".join(f"{head}<mrow>{row.replace(EQUALS, infix)}</mrow>{tail}" for row in rows) if parts else made


def python(code):
    """Python code with its kinds of words marked."""
    return f'<pre class="code"><code>{highlight(code, PythonLexer(), HtmlFormatter(nowrap=True))}</code></pre>'


def anchor(words):
    """The id of a heading."""
    return re.sub(r"[^a-z0-9]+", "-", html.unescape(re.sub(r"<.*?>", "", words)).lower()).strip("-")


def linked(target):
    """A link's target in the book: notebooks have pages."""
    return NOTEBOOK.sub(r"\1.html", target)


class _Page(mistune.HTMLRenderer):
    def __init__(self):
        super().__init__(escape=False)

    def heading(self, text, level, **attributes):
        return f'<h{level} id="{anchor(text)}">{text}</h{level}>\n'

    def link(self, text, url, title=None):
        return super().link(text, linked(url), title)

    def block_code(self, code, info=None):
        return python(code) if info == "python" else f"<pre><code>{html.escape(code)}</code></pre>\n"

    def formula(self, tex):
        return mathml(tex)

    def displayed(self, tex):
        return f'<div class="formula" tabindex="0" role="group" aria-label="formula">{mathml(tex, block=True)}</div>\n'


def _formulas(markdown):
    def inline(inline_parser, match, state):
        state.append_token({"type": "formula", "raw": match["formula_tex"]})
        return match.end()

    def block(block_parser, match, state):
        state.append_token({"type": "displayed", "raw": match["displayed_tex"]})
        return match.end() + 1

    markdown.inline.register("formula", FORMULA, inline, before="link")
    markdown.block.register("displayed", DISPLAYED, block, before="list")


_markdown = mistune.create_markdown(renderer=_Page(), plugins=["table", _formulas])


def as_html(markdown):
    """Markdown as HTML; wide tables scroll."""
    made = _markdown(markdown)
    return made.replace("<table>", '<div class="wide" tabindex="0"><table>').replace("</table>", "</table></div>")
