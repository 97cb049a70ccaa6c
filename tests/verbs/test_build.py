"""One source, two notebooks: the same bytes each time, nothing of one machine in them, stale and broken ones named."""

import base64
import io
import json
import textwrap

import numpy as np
import pytest
from PIL import Image

from labkit.verbs import build

CHAPTER = textwrap.dedent('''\
    # %% intro [markdown]
    # # A small chapter

    # %% double-code
    def double(x):
        """Twice x."""
        ### BEGIN SOLUTION
        return 2 * x
        ### END SOLUTION

    # %% value
    answer = ...  # your code here
    ### BEGIN SOLUTION
    answer = double(21)
    ### END SOLUTION
    print("the answer is", answer)
    answer

    # %% mode
    import os

    print("strict:", os.environ["LABKIT_STRICT"], "own progress:", "LABKIT_PROGRESS" in os.environ)

    # %% time tags=["nbval-ignore-output"]
    import time

    print(time.time())

    # %% picture
    from IPython.display import HTML, Image, display

    display(Image(data=b"\\x89PNG\\r\\n\\x1a\\n", format="png"), HTML("<b>bold</b>"))

    # %% lecturer [markdown] tags=["solution"]
    # Only in the solved notebook.

    # %% scratch [markdown] tags=["student"]
    # Only in the blank one.
    ''')


@pytest.fixture
def house(tmp_path):
    """A checkout with one chapter."""
    (tmp_path / "solutions").mkdir()
    (tmp_path / "solutions" / "01_small.py").write_text(CHAPTER, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The same, built twice: {file: bytes} of either time."""
    root = tmp_path_factory.mktemp("house")
    (root / "solutions").mkdir()
    (root / "solutions" / "01_small.py").write_text(CHAPTER, encoding="utf-8")
    files = [root / "notebooks" / "01_small.ipynb", root / "solutions" / "01_small.ipynb"]
    runs = []
    for _ in range(2):
        assert build.main([], root) == 0
        runs.append([path.read_bytes() for path in files])
    return root, runs


def cells(text):
    return {cell["id"]: cell for cell in json.loads(text)["cells"]}


def test_two_builds_give_the_same_bytes(built):
    _, (first, second) = built
    assert first == second


def test_the_blank_notebook_has_stubs_and_no_outputs(built):
    blank = cells(built[1][0][0])
    assert list(blank) == ["intro", "double-code", "value", "mode", "time", "picture", "scratch"]
    assert "".join(blank["double-code"]["source"]).endswith('"""Twice x."""\n    ...  # your code here')
    assert "".join(blank["value"]["source"]).startswith("answer = ...  # your code here\nprint")
    code = [cell for cell in blank.values() if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)


def test_the_solved_notebook_is_executed_strictly_and_holds_text_only(built):
    solved = cells(built[1][0][1])
    assert list(solved) == ["intro", "double-code", "value", "mode", "time", "picture", "lecturer"]
    assert solved["value"]["outputs"][0]["text"] == ["the answer is 42\n"]
    assert solved["value"]["outputs"][1]["data"] == {"text/plain": ["42"]}
    assert solved["mode"]["outputs"][0]["text"] == ["strict: 1 own progress: True\n"]
    assert [sorted(output["data"]) for output in solved["picture"]["outputs"]] == [
        ["text/plain"],
        ["text/html", "text/plain"],
    ]
    counts = [cell["execution_count"] for cell in solved.values() if cell["cell_type"] == "code"]
    assert counts == [1, 2, 3, 4, 5]
    assert solved["time"]["metadata"] == {"tags": ["nbval-ignore-output"]} and solved["time"]["outputs"] == []


def test_metadata_says_python_and_no_version(built):
    for content in built[1][0]:
        assert json.loads(content)["metadata"] == {"kernelspec": build.KERNEL, "language_info": {"name": "python"}}


def test_check_is_content_with_what_was_just_built(built, capsys):
    root, _ = built
    assert build.main(["--check"], root) == 0
    assert build.main(["--check", "--execute"], root) == 0
    assert "1 chapters are as their sources say" in capsys.readouterr().out


@pytest.mark.parametrize("folder", ["notebooks", "solutions"])
def test_check_names_the_stale_file_and_says_what_to_do(built, folder, capsys):
    root, _ = built
    path = root / folder / "01_small.ipynb"
    fresh = path.read_text(encoding="utf-8")
    try:
        path.write_text(fresh.replace("Twice", "Half"), encoding="utf-8", newline="\n")
        assert build.main(["--check"], root) == 1
    finally:
        path.write_text(fresh, encoding="utf-8", newline="\n")
    printed = capsys.readouterr().out
    assert f"01_small: {folder}/01_small.ipynb is not what solutions/01_small.py gives" in printed
    assert printed.endswith("run: python lab.py build 01\n")


def test_check_with_execute_finds_outputs_that_no_longer_come_out(built, capsys):
    root, _ = built
    path = root / "solutions" / "01_small.ipynb"
    fresh = path.read_text(encoding="utf-8")
    try:
        path.write_text(fresh.replace("the answer is 42", "the answer is 41"), encoding="utf-8", newline="\n")
        assert build.main(["--check"], root) == 0
        assert build.main(["--check", "--execute"], root) == 1
    finally:
        path.write_text(fresh, encoding="utf-8", newline="\n")
    assert "outputs in solutions/01_small.ipynb are not what its cells give today" in capsys.readouterr().out


def test_check_finds_a_notebook_without_its_source_but_leaves_the_students_copies_alone(house, capsys):
    (house / "notebooks").mkdir()
    (house / "notebooks" / "07_gone.ipynb").write_text("{}", encoding="utf-8")
    (house / "notebooks" / "01_small.my-copy-1.ipynb").write_text("{}", encoding="utf-8")
    assert build.main(["--check"], house) == 1
    printed = capsys.readouterr().out
    assert "07_gone: notebooks/07_gone.ipynb has no source" in printed and "my-copy" not in printed


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("import sys; print('late', file=sys.stderr)", "this went to stderr: 'late'"),
        ("object()", "which differs on every machine"),
        ("print(__import__('tempfile').gettempdir())", "which differs on every machine"),
        ("import os; os._exit(1)", "the kernel died"),
    ],
)
def test_a_cell_that_cannot_be_stored_is_named(house, code, words, capsys):
    (house / "solutions" / "02_broken.py").write_text(f"# %% fine\nx = 1\n# %% culprit\n{code}\n", encoding="utf-8")
    assert build.main(["2"], house) == 1
    printed = capsys.readouterr().err
    assert printed.startswith("02_broken, cell 'culprit': ") and words in printed
    assert not (house / "solutions" / "02_broken.ipynb").exists()


def test_malformed_sources_and_unknown_chapters_are_refused_in_one_sentence(house, capsys):
    (house / "solutions" / "02_broken.py").write_text("# %% a\nx = 1\n# %% a\nx = 2\n", encoding="utf-8")
    assert build.main(["--check"], house) == 1
    assert capsys.readouterr().err == "02_broken.py, line 3: the cell id 'a' is already used in line 1\n"
    assert build.main(["9"], house) == 1
    assert "there are: 01_small, 02_broken" in capsys.readouterr().err


STAGE = """# %% figure
from IPython.display import display

picture = {"text/plain": "[stage: a dot] It is gray.", "image/png": "PNG"}
display(picture, metadata={"image/png": {"alt": "a dot"}}, raw=True)
"""


def png(shade, corner):
    """A gray picture of 20 x 20 pixels with one corner of another shade, in base64."""
    pixels = np.full((20, 20), shade, np.uint8)
    pixels[:2, :2] = corner
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png")
    return base64.b64encode(file.getvalue()).decode()


def test_a_stages_picture_is_stored_and_stays_until_another_would_look_different(house):
    def stored(*picture):
        (house / "solutions" / "01_small.py").write_text(STAGE.replace("PNG", png(*picture)), encoding="utf-8")
        assert build.main([], house) == 0
        (output,) = cells((house / "solutions" / "01_small.ipynb").read_bytes())["figure"]["outputs"]
        assert output["metadata"] == {"image/png": {"alt": "a dot"}}
        return output["data"]["image/png"].strip()

    first = stored(120, 120)
    assert first == png(120, 120)
    assert stored(121, 121) == first
    assert stored(120, 255) == png(120, 255)


def test_a_stage_in_words_alone_is_stale(house, capsys):
    (house / "solutions" / "01_small.py").write_text(STAGE.replace("PNG", png(9, 9)), encoding="utf-8")
    assert build.main([], house) == 0 and build.main(["--check"], house) == 0
    path = house / "solutions" / "01_small.ipynb"
    content = json.loads(path.read_text(encoding="utf-8"))
    del content["cells"][0]["outputs"][0]["data"]["image/png"]
    path.write_text(json.dumps(content), encoding="utf-8")
    assert build.main(["--check"], house) == 1
    assert "solutions/01_small.ipynb is not what" in capsys.readouterr().out


def test_of_outputs_that_differ_each_time_only_a_stages_picture_and_name_are_stored(house):
    source = STAGE.replace("# %% figure", '# %% figure tags=["nbval-ignore-output"]') + "print(1)\n"
    (house / "solutions" / "01_small.py").write_text(source.replace("PNG", png(9, 9)), encoding="utf-8")
    assert build.main([], house) == 0
    (output,) = cells((house / "solutions" / "01_small.ipynb").read_bytes())["figure"]["outputs"]
    assert output["data"]["text/plain"] == ["[stage: a dot]"] and "image/png" in output["data"]
