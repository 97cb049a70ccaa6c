"""Every Stage in four sizes and two themes, at first and failed: `python tests/browser/contact_sheets.py OUT [NN ...]`.

Writes OUT/NN-light-1.png, NN-light-failed-1.png and the same of the dark theme, a row a Stage and a column a size, and
names what is cut or does not fit, letters of the picture that are too small, what has no name or no ring, and what keys
do not reach. Motion is reduced.
The page is `stage.js` with Python behind it, as everywhere; it needs a Chromium, no JupyterLab.
"""

import argparse
import base64
import contextlib
import importlib
import io
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "browser")]

import driver  # noqa: E402
import nbformat  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from PIL import Image, ImageDraw  # noqa: E402

from labkit.book.notebook import stages_of  # noqa: E402
from labkit.exercises import source  # noqa: E402
from labkit.stage.canvas import SMALLEST  # noqa: E402

SIZES = {  # width and height in CSS pixels, device pixels a CSS pixel
    "1920x1080": (1620, 950, 1),
    "1280x720 at 150 %": (700, 359, 1.5),
    "half a screen, 900 px": (620, 650, 1),
    "a phone": (360, 640, 2),
}
LOOKS = ("light", "light-failed", "dark-failed", "dark")  # each is one change from the one before
COLUMNS, ROWS, GAP, HEAD = (560, 400, 380, 220), 3, 8, 22  # widths in pixels of a sheet, and Stages of one
COLORS = {False: ("#ffffff", "#1a1a1a"), True: ("#111111", "#e8e8e8")}
MODEL = """
window.show = (declaration) => {
  const hears = new Set();
  const model = {
    get: (key) => (key === "declaration" ? declaration : undefined),
    on: (kind, hear) => { if (kind === "msg:custom") hears.add(hear); },
    off: (kind, hear) => hears.delete(hear),
    send: async (message) => {
      for (const [said, files] of await window.toPython(message)) {
        const buffers = files.map((file) => new DataView(Uint8Array.from(atob(file), (c) => c.charCodeAt(0)).buffer));
        for (const hear of hears) hear(said, buffers);
      }
    },
  };
  document.body.replaceChildren();
  window.close_?.();
  window.close_ = render({ model, el: document.body });
};
window.bring = (drawing) => initialize({ model: { get: () => new TextEncoder().encode(drawing) } });
"""
CUT = """() => {
  const stage = document.querySelector(".labkit-stage");
  const box = stage.getBoundingClientRect();
  const said = [];
  if (box.height > innerHeight + 1) said.push(`${Math.round(box.height - innerHeight)} px too high`);
  for (const node of stage.querySelectorAll("*")) {
    const its = node.getBoundingClientRect();
    if (its.width && its.right > box.right + 1 && !node.matches(".handle, .spoken, .hint")) said.push(`${node.className || node.tagName} sticks out`);
  }
  return [...new Set(said)];
}"""  # fmt: skip # noqa: E501


UNHEARD = """() => {
  const stage = document.querySelector(".labkit-stage");
  const said = [];
  const named = (node) => node.getAttribute("aria-label") || [...(node.labels ?? [])].map((l) => l.textContent.trim()).join(" ") || node.textContent.trim();
  for (const node of stage.querySelectorAll("input, select, button, .handle, .number, canvas:not(.space)")) {
    const called = node.className || node.tagName;
    if (!named(node)) said.push(`${called} has no name`);
    if (node.tabIndex < 0 && !node.matches("canvas")) said.push(`${called} is not reached by Tab`);
  }
  for (const handle of stage.querySelectorAll(".handle:not([hidden])")) {
    const ring = getComputedStyle(handle, "::after");
    if (ring.borderTopStyle !== "solid" || parseFloat(ring.borderTopWidth) < 1.5) said.push(`${handle.dataset.handle} has no ring`);
    if (handle.getAttribute("role") !== "slider" || !handle.getAttribute("aria-valuetext")) said.push(`${handle.dataset.handle} does not say where it is`);
  }
  const canvas = stage.querySelector("canvas:not(.space)");
  const touched = canvas.dataset.empty || canvas.dataset.click === "true";
  if (touched && (canvas.tabIndex !== 0 || !canvas.getAttribute("aria-description"))) said.push("empty space does something, but not by keys");
  if (!stage.querySelector("[aria-live=polite]") || !stage.getAttribute("aria-label")) said.push("is not announced");
  return [...new Set(said)];
}"""  # noqa: E501


class Bridge:
    """A Stage behind a page: messages of the page in, what it sends back out."""

    def __init__(self):
        self.stage, self.said, self.is_gone, self.unheard = None, [], False, []

    def connect(self, stage):
        if stage is not self.stage:
            stage.connect(lambda message, buffers: self.said.append((message, buffers)))
        self.stage = stage

    def show(self, page, stage):
        self.connect(stage)
        page.evaluate("declaration => window.show(declaration)", stage.declaration())
        drawn = "canvas[data-space=true]" if stage.spaces else "canvas"
        page.locator(f".labkit-stage[data-picture] {drawn}").first.wait_for(timeout=20_000)
        page.evaluate(driver.RESTS)

    def __call__(self, message):
        if self.is_gone:
            self.unheard.append(message)
            return []
        self.stage.receive(message)
        said, self.said = self.said, []
        return [[told, [base64.b64encode(file).decode() for file in files]] for told, files in said]


@contextlib.contextmanager
def stage_page(dark, width, height, ratio):
    """(page, bridge): an empty page that shows what `bridge.show(page, stage)` is given."""
    script = (ROOT / "labkit" / "stage" / "stage.js").read_text(encoding="utf-8").replace("export default", "//")
    bridge = Bridge()
    with driver.page_of(driver.find_browser(), dark, width, height, ratio, calm=True) as page:
        page.expose_function("toPython", bridge)
        page.set_content("<!DOCTYPE html><title>sheets</title><style id=theme></style><body></body>")
        page.add_style_tag(content=(ROOT / "labkit/stage/stage.css").read_text(encoding="utf-8"))
        page.add_script_tag(content=f"{{{script}{MODEL}}}")
        dress(page, dark)
        yield page, bridge


def dress(page, dark):
    """Give the page a theme."""
    paper, words = COLORS[dark]
    look = f".labkit-stage {{ --words: {words} !important; --paper: {paper} !important; }}"
    look += f"body {{ margin: 0; background: {paper}; color: {words}; }}"
    theme = f":root {{ color-scheme: {'dark' if dark else 'light'}; --jp-content-font-color1: {words}; }}"
    told = "(words) => { document.getElementById('theme').textContent = words; document.body.dataset.theme = words; }"
    page.evaluate(told, look + theme)


def stages(numbers):
    """{stem: [names]} of the Stages that the solved notebooks show."""
    found = {}
    for path in [source.find(number) for number in numbers] or source.sources():
        names = list(stages_of(nbformat.read(path.with_suffix(".ipynb"), as_version=4)).values())
        if names:
            found[path.stem] = names
    return found


def shots(found, size, said):
    """{(theme, stem, name): picture} in one size; `said(stem, name, words)` hears what is cut, too small, or cannot be
    heard or reached by keys.
    """
    made = {}
    with stage_page(False, *SIZES[size]) as (page, bridge):
        for stem, names in found.items():
            module = importlib.import_module(f"labkit.chapters.ch{stem}.stages")
            for name in names:
                stage = getattr(module, name)()
                dress(page, False)
                for look, change in zip(LOOKS, (bridge.show, fail, dress, reset)):
                    change(page, stage if change == bridge.show else True)
                    page.evaluate(driver.RESTS)
                    picture = page.locator(".labkit-stage").screenshot()
                    made[look, stem, name] = Image.open(io.BytesIO(picture)).convert("RGB")
                    for words in [*page.evaluate(CUT), *page.evaluate(UNHEARD), *small_letters(stage)]:
                        said(stem, f"{name}, {look}, {size}", words)
        for words in page.complaints:
            print("console:", words)
    return made


def fail(page, _):
    page.get_by_role("button", name="Make it fail", exact=True).click()


def reset(page, _):
    page.get_by_role("button", name="Reset", exact=True).click()


def small_letters(stage):
    """What the picture writes in letters below SMALLEST."""
    fig, ratio = stage.figure, stage.figure.bbox.width / stage._picture.width
    sizes = [text.get_fontsize() * fig.dpi / 72 / ratio for text in fig.findobj(Text) if text.get_text().strip()]
    return [f"letters of {min(sizes):.1f} px"] if sizes and min(sizes) < SMALLEST - 0.01 else []


def sheet(rows):
    """One picture of [(title, [pictures])], a row each."""
    small = [
        (title, [p.resize((w, round(p.height * w / p.width)), Image.LANCZOS) for p, w in zip(pictures, COLUMNS)])
        for title, pictures in rows
    ]
    heights = [HEAD + max(p.height for p in pictures) + GAP for _, pictures in small]
    whole = Image.new("RGB", (sum(COLUMNS) + len(COLUMNS) * GAP, sum(heights)), "#808080")
    pen, top = ImageDraw.Draw(whole), 0
    for (title, pictures), height in zip(small, heights):
        left = 0
        for size, picture in zip(SIZES, pictures):
            pen.text((left + 4, top + 5), f"{title}: {size}", fill="white")
            whole.paste(picture, (left, top + HEAD))
            left += picture.width + GAP
        top += height
    return whole


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("chapters", nargs="*")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    found, count = stages(options.chapters), 0

    def said(stem, where, words):
        nonlocal count
        count += 1
        print(f"{stem} {where}: {words}", flush=True)

    for stem, names in found.items():
        made = {size: shots({stem: names}, size, said) for size in SIZES}
        for look in LOOKS:
            rows = [(name, [made[size][look, stem, name] for size in SIZES]) for name in names]
            for k in range(0, len(rows), ROWS):
                sheet(rows[k : k + ROWS]).save(options.folder / f"{stem[:2]}-{look}-{1 + k // ROWS}.png")
    pictures = len(SIZES) * len(LOOKS) * sum(map(len, found.values()))
    print(f"{pictures} pictures, {count} things to look at")


if __name__ == "__main__":
    main()
