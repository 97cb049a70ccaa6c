"""What of a solved notebook a book shows."""

import re

STAGE = re.compile(r"\bstages\.(\w+)")
PERSONAL = ("course_map()", "ex.progress()")  # what these show is the reader's own


def stages_of(notebook):
    """{cell id: name of the function in the chapter's `stages`} of the cells that show a Stage."""
    found = {}
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if output.get("data", {}).get("text/plain", "").startswith("[stage: "):
                found[cell.id] = STAGE.search(cell.source)[1]
    return found


def is_personal(cell):
    """Whether a cell shows what the reader has done: a book does not know that."""
    return cell.cell_type == "code" and cell.source.strip() in PERSONAL


def lacks_outputs(notebook):
    """Whether outputs that a book shows are not stored, as they differ from day to day."""
    ignored = [cell for cell in notebook.cells if "nbval-ignore-output" in cell.metadata.get("tags", [])]
    return any(not cell.outputs and not is_personal(cell) for cell in ignored)
