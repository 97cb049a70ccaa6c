"""The reader of the notebook sources: what students get, what they do not, and every malformed source refused."""

import textwrap

import jupytext
import pytest

from labkit.exercises import source

GOOD = textwrap.dedent('''\
    # %% the-question [markdown]
    # # Frames
    #
    # How far apart are **K0** and K1?

    # %% set-up
    from math import pi

    # %% area-code
    def area(r):
        """Area of a disc."""
        ### BEGIN SOLUTION
        square = r * r

        return pi * square
        ### END SOLUTION


    # %% value tags=["nbval-ignore-output"]
    answer = ...  # your code here
    ### BEGIN SOLUTION
    answer = area(2.0)
    ### END SOLUTION
    print(answer)

    # %% afterword [markdown] tags=["solution"]
    # For lecturers.

    # %% play tags=["student"]
    scratch = ...  # your code here
    ''')


def write(tmp_path, text, name="01_frames.py"):
    path = tmp_path / name
    path.write_text(textwrap.dedent(text), encoding="utf-8")
    return path


def test_cells_are_read_in_order_with_their_tags_and_lines(tmp_path):
    cells = source.read(write(tmp_path, GOOD))
    assert [c.id for c in cells] == ["the-question", "set-up", "area-code", "value", "afterword", "play"]
    assert [c.kind for c in cells] == ["markdown", "code", "code", "code", "markdown", "code"]
    assert [c.tags for c in cells] == [(), (), (), ("nbval-ignore-output",), ("solution",), ("student",)]
    assert cells[0].text == "# Frames\n\nHow far apart are **K0** and K1?"
    assert [c.line for c in cells][:3] == [1, 6, 9]


def test_jupytext_reads_the_same_cells(tmp_path):
    """An independent reader of the format agrees on kind, id (its title), tags and text."""
    ours = source.read(write(tmp_path, GOOD))
    theirs = jupytext.reads(GOOD, fmt="py:percent").cells
    assert len(ours) == len(theirs)
    for cell, other in zip(ours, theirs):
        assert (cell.kind, cell.id, cell.text) == (other.cell_type, other.metadata["title"], other.source)
        assert list(cell.tags) == other.metadata.get("tags", [])


def test_a_region_becomes_the_stub_at_its_indentation():
    text = 'def f(x):\n    """Doc."""\n    ### BEGIN SOLUTION\n    y = x\n\n    return y\n    ### END SOLUTION\n\nf(1)'
    assert source.blank(text) == 'def f(x):\n    """Doc."""\n    ...  # your code here\n\nf(1)'
    assert source.solved(text) == 'def f(x):\n    """Doc."""\n    y = x\n\n    return y\n\nf(1)'
    assert source.region(text) == "y = x\n\nreturn y"


def test_a_stub_above_the_region_is_kept_for_the_student_and_dropped_from_the_solution():
    stubs = "a = ...  # your code here\nb = ...  # your code here\n"
    text = stubs + "### BEGIN SOLUTION\na, b = 1, 2\n### END SOLUTION\nprint(a)"
    assert source.blank(text) == stubs + "print(a)"
    assert source.solved(text) == "a, b = 1, 2\nprint(a)"
    assert source.region(text) == "a, b = 1, 2"


def test_a_region_may_be_the_whole_cell_and_there_may_be_several():
    whole = "### BEGIN SOLUTION\nx = 1\n### END SOLUTION"
    assert source.blank(whole) == "...  # your code here"
    assert source.solved(whole) == "x = 1"
    begin, end, stub = "### BEGIN SOLUTION\n", "### END SOLUTION\n", "...  # your code here\n"
    two = f"def f(x):\n  {begin}  a = 1\n  {end}  if x:\n    {begin}    return a\n    {end}  return 0"
    assert source.blank(two) == f"def f(x):\n  {stub}  if x:\n    {stub}  return 0"
    assert source.region(two) == "a = 1\nreturn a"


def test_text_without_regions_passes_unchanged():
    text = "x = 1\n\ny = 2"
    assert source.blank(text) == source.solved(text) == text
    assert source.region(text) == ""


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("x = 1\n", 1, "before the first code"),
        ("# only a comment\n", 1, "found none"),
        ("# %%\nx = 1\n", 1, "the-id"),
        ("# %% [markdown]\n# text\n", 1, "the-id"),
        ("# %% Two Words\nx = 1\n", 1, "the-id"),
        ("#%% tight\nx = 1\n", 1, "the-id"),
        ("# %% a [raw]\nx = 1\n", 1, "the-id"),
        ("# %% a\nx = 1\n# %% a\nx = 2\n", 3, "already used in line 1"),
        ('# %% a tags=["lecturer"]\nx = 1\n', 1, "unknown tag 'lecturer'"),
        ("# %% a tags=[solution]\nx = 1\n", 1, "expected tags"),
        ('# %% a tags=["solution", "student"]\nx = 1\n', 1, "neither"),
        ("# %% a\n\n# %% b\nx = 1\n", 1, "'a' is empty"),
        ("# %% a [markdown]\n#\n", 1, "'a' is empty"),
        ("# %% a [markdown]\n# text\nx = 1\n", 3, "markdown"),
        ("# %% a [markdown]\n# text\n# ### BEGIN SOLUTION\n", 3, "code cells"),
        ("# %% a\nx = 1\n%matplotlib inline\n", 3, "magics"),
        ("# %% a\n!ls\n", 2, "magics"),
        ("# %% a\nx = 1\nx?\n", 3, "magics"),
        ("# %% a\n?x\n", 2, "magics"),
        ("# %% a\n# %matplotlib widget\nx = 1\n", 2, "magic"),
        ("# %% a\nget_ipython().system('ls')\n", 2, "magics"),
        ("# %% a\n\ndef f(:\n", 3, "does not parse"),
        ("# %% a\nx = 1\n### BEGIN SOLUTION\ny = 2\n", 3, "without ### END SOLUTION"),
        ("# %% a\n### END SOLUTION\n", 2, "without ### BEGIN SOLUTION"),
        ("# %% a\n### BEGIN SOLUTION\nx = 1\n### BEGIN SOLUTION\n", 4, "begins in line 2"),
        ("# %% a\n### BEGIN SOLUTION\nx = 1\n# %% b\n### END SOLUTION\n", 2, "without ### END SOLUTION"),
        ("# %% a\n### BEGIN SOLUTION\n\n### END SOLUTION\n", 2, "empty"),
        ("# %% a\n# BEGIN SOLUTION\nx = 1\n", 2, "write the marker"),
        ('# %% a tags=["student"]\n### BEGIN SOLUTION\nx = 1\n### END SOLUTION\n', 2, "students only"),
        ("# %% a\nx = ...  # your code here\nx = 1\n", 2, "directly above"),
        ("# %% a\nx = 1\n\n  \n# %% b\n", 5, "'b' is empty"),
    ],
)
def test_malformed_sources_are_refused_with_file_and_line(tmp_path, text, line, words):
    path = tmp_path / "03_quirlen.py"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(source.SourceError) as refused:
        source.read(path)
    message = str(refused.value)
    assert message.startswith(f"03_quirlen.py, line {line}: ") and words in message, message


def test_a_cell_that_parses_only_with_its_solution_is_refused(tmp_path):
    text = "# %% a\ntry:\n    x = 1\n### BEGIN SOLUTION\nexcept ValueError:\n    x = 2\n### END SOLUTION\n"
    path = write(tmp_path, text)
    with pytest.raises(source.SourceError, match="line 1: the cell 'a' does not parse without its solution"):
        source.read(path)


def test_percent_signs_in_strings_and_arithmetic_are_no_magics(tmp_path):
    path = write(tmp_path, '# %% a\nx = (7\n     % 2)\ntext = """\n%not a magic\n!nor this\n"""\n# 50 % of it\n')
    assert len(source.read(path)) == 1


def test_a_jupytext_header_may_stand_above_the_first_cell(tmp_path):
    path = write(tmp_path, "# ---\n# jupyter:\n#   kernelspec: {name: python3}\n# ---\n\n# %% a\nx = 1\n")
    assert [cell.id for cell in source.read(path)] == ["a"]


def test_chapters_are_found_by_number_and_by_name(tmp_path):
    first, tenth = write(tmp_path, GOOD), write(tmp_path, GOOD, "10_ledger.py")
    write(tmp_path, GOOD, "helper.py")
    assert source.sources(tmp_path) == [first, tenth]
    for word in (1, "1", "01", "01_frames", "01-frames"):
        assert source.find(word, tmp_path) == first
    assert source.find("10", tmp_path) == tenth
    with pytest.raises(ValueError, match="got '7'; there are: 01_frames, 10_ledger"):
        source.find("7", tmp_path)
