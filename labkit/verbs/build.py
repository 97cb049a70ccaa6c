"""Two notebooks from one source: `solutions/NN_name.py` gives `notebooks/NN_name.ipynb` and `solutions/NN_name.ipynb`.

The first is blank: no solution, no output. The second is solved, executed in strict mode, where an exercise that is not
correct is an error, and stores its text and HTML outputs for nbval to compare, and one small picture of every Stage.
Both come out byte for byte the same each time: cell ids from the source, no timestamps, no widget state, no addresses
or paths of one machine; a stored picture stays until another would look different.
`python lab.py build` runs `main`.
"""

import asyncio
import base64
import io
import os
import re
import sys
import tempfile
from pathlib import Path

import nbformat
import numpy as np
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from PIL import Image

from ..exercises import source
from ..places import IS_CHECKOUT
from ..reading import regular
from .arguments import Parser, Refusal
from .notebook_copies import write

KERNEL = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
SECONDS_A_CELL = 60
UNSTABLE = ("image/jpeg", "image/svg+xml", "application/vnd.jupyter.widget-view+json")
VISIBLE_LEVELS, VISIBLE_SHARE = 32, 0.002  # of 255 in a color; of all pixels


class BuildError(Exception):
    """A chapter that cannot be built, with the chapter, the cell and the reason in one sentence."""


def blank_notebook(path):
    """The student's notebook of a source file: solutions replaced by stubs, cells tagged "solution" left out."""
    return _notebook(path, source.blank, without="solution")


def solved_notebook(path):
    """The complete notebook of a source file, not yet executed; cells tagged "student" are left out."""
    return _notebook(path, source.solved, without="student")


def _notebook(path, version, without):
    cells = []
    for cell in source.read(path):
        if without in cell.tags:
            continue
        tags = [tag for tag in cell.tags if tag not in source.BUILD_TAGS]
        metadata = {"tags": tags} if tags else {}
        if cell.kind == "markdown":
            cells.append(new_markdown_cell(cell.text, id=cell.id, metadata=metadata))
        else:
            cells.append(new_code_cell(version(cell.text), id=cell.id, metadata=metadata))
    return new_notebook(cells=cells, metadata={"kernelspec": KERNEL, "language_info": {"name": "python"}})


def as_text(notebook):
    """The notebook as the bytes-to-be of its file."""
    nbformat.validate(notebook)
    return nbformat.writes(notebook, version=4) + "\n"


async def execute(notebook, chapter, folder, strict=True):
    """Run all cells of a notebook in place, in a fresh kernel that imports this checkout and touches no one's progress.

    Raises
    ------
    BuildError
        Naming chapter, cell id and error, at the first cell that raises, takes over a minute or kills the kernel.
    """
    running = []
    client = NotebookClient(
        notebook,
        kernel_name=KERNEL["name"],
        timeout=SECONDS_A_CELL,
        record_timing=False,
        coalesce_streams=True,
        extra_arguments=["--log-level=ERROR"],
        on_cell_start=lambda cell, cell_index: running.append(cell.id),
        resources={"metadata": {"path": str(folder)}},
    )
    with tempfile.TemporaryDirectory() as scratch:
        try:
            await client.async_execute(env=kernel_environment(scratch, strict))
        except CellExecutionError as error:
            reason = f"{error.ename}: {re.sub(chr(27) + r'.*?m', '', error.evalue)}"
        except CellTimeoutError:
            reason = f"it takes longer than {SECONDS_A_CELL} s"
        except DeadKernelError:
            reason = "the kernel died"
        else:
            return
    raise BuildError(f"{chapter}, cell {running[-1]!r}: {reason}")


def kernel_environment(scratch, strict):
    """The environment of a built or tested kernel: this checkout first, a progress file and IPython of its own."""
    paths = [str(source.ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "LABKIT_STRICT": "1" if strict else "",
        "LABKIT_PROGRESS": str(Path(scratch) / "progress.jsonl"),
        "IPYTHONDIR": str(Path(scratch) / "ipython"),
    }


def clean(notebook, chapter):
    """Take from executed cells what changes from run to run or machine to machine; refuse what cannot be taken.

    Outputs that nbval is told to ignore are not stored, but for the picture of a Stage.
    """
    notebook.metadata.pop("widgets", None)
    notebook.metadata["language_info"] = {"name": "python"}
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            ignored = "nbval-ignore-output" in cell.metadata.get("tags", [])
            cell.outputs = [output for output in cell.outputs if _keep(output) and (not ignored or _named(output))]
            for output in cell.outputs:
                _refuse_unstable(output, f"{chapter}, cell {cell.id!r}")
    return notebook


def _keep(output):
    """Whether something of an output is left to store: text, and a picture that has words for those who cannot see."""
    if "data" not in output:
        return True
    for kind in UNSTABLE:
        output.data.pop(kind, None)
    words = output.metadata.get("image/png", {}).get("alt")
    if not words:
        output.data.pop("image/png", None)
    output.metadata = nbformat.from_dict({"image/png": {"alt": words}} if words else {})
    return bool(output.data)


def _named(output):
    """Whether an output is a Stage's picture; its words are then cut down to the name, as they differ each time."""
    name = re.match(r"\[stage: .*?\]", output.get("data", {}).get("text/plain", ""))
    if not name or "image/png" not in output.data:
        return False
    output.data["text/plain"] = name[0]
    output.metadata["image/png"]["alt"] = name[0]
    return True


def keep_pictures(notebook, path):
    """Take the pictures stored in the file `path`, where those of the notebook look the same; returns the notebook."""
    if path.exists():
        stored = {cell.id: _pictures(cell) for cell in nbformat.read(regular(path), as_version=4).cells}
        for cell in notebook.cells:
            for new, old in zip(_pictures(cell), stored.get(cell.id, [])):
                if looks_like(new["image/png"], old["image/png"]):
                    new["image/png"] = old["image/png"]
    return notebook


def _pictures(cell):
    return [o.data for o in cell.get("outputs", []) if "image/png" in o.get("data", {})]


def looks_like(new, old):
    """Whether two pictures, PNG in base64, cannot be told apart by eye."""
    a, b = (np.asarray(Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")).astype(int) for png in (new, old))
    return a.shape == b.shape and (np.abs(a - b).max(-1) > VISIBLE_LEVELS).mean() <= VISIBLE_SHARE


def _refuse_unstable(output, where):
    if output.get("name") == "stderr":
        raise BuildError(
            f"{where}: a built notebook warns of nothing, but this went to stderr: {output.text.strip()!r}"
        )
    told = [str(value) for kind, value in output.get("data", {}).items() if kind != "image/png"]
    text = output.text if "text" in output else "\n".join(told)
    paths = {str(source.ROOT), sys.prefix, tempfile.gettempdir(), str(Path.home())} - {os.sep}
    found = re.search("|".join([r"0x[0-9a-f]{6,}", r"ipykernel_\d+", *map(re.escape, sorted(paths))]), text)
    if found:
        raise BuildError(f"{where}: the output holds {found[0]!r}, which differs on every machine")


def build(paths, notebooks, solutions):
    """Write blank and solved notebooks of the sources `paths`, one kernel a processor at a time.

    Every chapter is tried; the `BuildError`s of those that failed are raised together at the end.
    """
    for path in paths:
        write(notebooks / f"{path.stem}.ipynb", as_text(blank_notebook(path)))
    failed = [str(error) for error in asyncio.run(_build_solved(paths, solutions)) if error]
    if failed:
        raise BuildError("\n".join(failed))


async def _build_solved(paths, solutions):
    kernels = asyncio.Semaphore(os.cpu_count() or 2)

    async def one(path):
        async with kernels:
            try:
                write(solutions / f"{path.stem}.ipynb", await executed_text(path, solutions))
            except BuildError as error:
                return error

    return await asyncio.gather(*map(one, paths))


async def executed_text(path, solutions):
    """The text of the solved notebook's file in the folder `solutions`, executed afresh."""
    notebook = solved_notebook(path)
    await execute(notebook, path.stem, path.parent)
    return as_text(keep_pictures(clean(notebook, path.stem), solutions / f"{path.stem}.ipynb"))


def stale(paths, notebooks, solutions, rerun=False):
    """What is not as the sources say: one sentence a stale file, none when all are fresh.

    The blank notebook is compared whole, of the solved one everything but its outputs; whether these still come out is
    nbval's to prove, or this function's with `rerun`, which executes the chapters again.
    """
    found = []
    for path in paths:
        name = f"{path.stem}.ipynb"
        if _text(notebooks / name) != as_text(blank_notebook(path)):
            found.append(f"{path.stem}: notebooks/{name} is not what solutions/{path.name} gives")
        if not _is_solved(solutions / name, path):
            found.append(f"{path.stem}: solutions/{name} is not what solutions/{path.name} gives")
        elif rerun and _text(solutions / name) != asyncio.run(executed_text(path, solutions)):
            found.append(f"{path.stem}: the outputs in solutions/{name} are not what its cells give today")
    return found


def _text(path):
    return regular(path).read_text(encoding="utf-8") if path.exists() else None


def _is_solved(path, source_path):
    if not path.exists():
        return False
    stored = nbformat.read(regular(path), as_version=4)
    counts = [cell.execution_count for cell in stored.cells if cell.cell_type == "code"]
    if any(_lacks_picture(output) for cell in stored.cells for output in cell.get("outputs", [])):
        return False
    for cell in stored.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    bare = nbformat.writes(stored, version=4) + "\n"
    return bare == as_text(solved_notebook(source_path)) and counts == list(range(1, len(counts) + 1))


def _lacks_picture(output):
    """Whether a stored output is a Stage in words alone."""
    data = output.get("data", {})
    return data.get("text/plain", "").startswith("[stage: ") and "image/png" not in data


def orphans(notebooks, solutions):
    """Generated notebooks whose source is gone, one sentence each."""
    known = {path.stem for path in source.sources(solutions)}
    return [
        f"{path.stem}: {path.parent.name}/{path.name} has no source solutions/{path.stem}.py"
        for folder in (notebooks, solutions)
        for path in sorted(folder.glob("[0-9][0-9]_*.ipynb"))
        if path.stem not in known and ".my-copy-" not in path.name
    ]


def main(arguments=None, root=source.ROOT):
    """`python lab.py build [NN ...] [--check [--execute]]`; returns the exit code."""
    parser = Parser("build", description="Write the notebooks from their sources.")
    parser.add_argument(
        "chapters", nargs="*", metavar="NN", help="number or name of a chapter; all of them if none is given"
    )
    parser.add_argument("--check", action="store_true", help="write nothing, say which notebooks are stale")
    parser.add_argument(
        "--execute", action="store_true", help="with --check: execute the solved notebooks again as well"
    )
    options = parser.parse_args(arguments)
    if not (IS_CHECKOUT or root != source.ROOT):
        raise Refusal("Notebooks are built where their sources are written: in a checkout of the repository.")
    notebooks, solutions = root / "notebooks", root / "solutions"
    try:
        paths = [source.find(chapter, solutions) for chapter in options.chapters] or source.sources(solutions)
        if options.check:
            found = stale(paths, notebooks, solutions, options.execute) + orphans(notebooks, solutions)
            numbers = " ".join(sorted({sentence[:2] for sentence in found}))
            advice = (
                f"run: python lab.py build {numbers}" if found else f"{len(paths)} chapters are as their sources say"
            )
            print("\n".join([*found, advice]))
            return 1 if found else 0
        build(paths, notebooks, solutions)
        print(f"built {', '.join(path.stem for path in paths)}")
        return 0
    except (BuildError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
