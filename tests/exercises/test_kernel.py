"""In a real kernel: what IPython itself adds (exit, input, its own output) cannot hurt a check either."""

import nbformat
import pytest
from nbclient import NotebookClient

CELLS = [
    "import numpy as np\nfrom labkit.exercises import course\nex = course('01-frames')",
    "@ex.invert\ndef invert(T):\n    exit()",
    "@ex.invert\ndef invert(T):\n    quit()",
    "@ex.invert\ndef invert(T):\n    return input('?')",
    "@ex.invert\ndef invert(T):\n    while True:\n        pass",
    "@ex.invert\ndef invert(T):\n    get_ipython().ask_exit()",
    "@ex.invert\ndef invert(T):\n    return 1 / 0",
    "ex.distance(1.0)",
    "ex.distance(1.0)\nNone",
    "ex.predict('edges')",
    "print(invert(np.eye(4)).shape)",
    "import matplotlib.pyplot as plt\nplt.get_fignums()",
    "@ex.invert\ndef invert(T):\n    plt.rcParams['font.size'] = 40\n    plt.plot([1, 2])\n    plt.show()\n"
    "    plt.figure()\n    display(T)\n"
    "    get_ipython().events.register('post_run_cell', lambda _: 1 / 0)\n    return T",
    "print(plt.get_fignums(), plt.rcParams['font.size'])",
]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
    patch = pytest.MonkeyPatch()
    patch.setenv("LABKIT_PROGRESS", str(tmp_path_factory.mktemp("progress") / "progress.jsonl"))
    patch.delenv("LABKIT_STRICT", raising=False)
    try:
        NotebookClient(notebook, kernel_name="python3", timeout=60).execute()
    finally:
        patch.undo()
    return [text_of(cell.outputs) for cell in notebook.cells]


def text_of(outputs):
    return "\n".join(o.get("text") or o["data"]["text/plain"] for o in outputs)


@pytest.mark.parametrize(
    "cell, words",
    [
        (1, "calls exit()"),
        (2, "calls exit()"),
        (3, "calls input()"),
        (4, "did not finish within 2 s"),
        (5, "calls exit()"),
        (6, "return 1 / 0"),
        (7, "✗ distance: not yet"),
        (9, "[predict first: "),
        (10, "(4, 4)"),
        (12, "your code printed:\n<Figure size 640x480 with 1 Axes>\narray("),
        (13, "[] 10.0"),
    ],
)
def test_every_cell_answers_and_the_kernel_lives(outputs, cell, words):
    assert words in outputs[cell].replace("Your code", "your code"), outputs[cell]


def test_a_value_in_the_last_line_shows_feedback_once_and_no_number(outputs):
    assert outputs[7] == outputs[8]
    assert outputs[7].count("distance: not yet") == 1


def test_what_a_function_shows_does_not_appear_once_for_every_draw(outputs):
    assert outputs[12].count("<Figure") == 1 and "ZeroDivisionError" not in outputs[12] + outputs[13]
