"""A broken table is refused with its file and line."""

import pytest

from labkit import tables


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "file is empty"),
        ("a,a\n1,2\n", "a column name appears twice"),
        ("a,b\n1,2\n3\n", "line 3: expected 2 entries, got 1"),
        ("a,b\n1,2\n3,x\n", "line 3: expected a number in column 'b', got 'x'"),
        ("a,b\n1,2\n", "expected a column 'name'"),
    ],
)
def test_broken_tables(tmp_path, monkeypatch, text, words):
    monkeypatch.setattr(tables, "DATA", tmp_path)
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ValueError, match=words):
        tables.read_table("t.csv", text=("name",) if "'name'" in words else ())


def test_columns_are_floats_or_text(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "DATA", tmp_path)
    (tmp_path / "t.csv").write_text("name,x\nK0,1.5\nK1,-2\n")
    table = tables.read_table("t.csv", text=("name",))
    assert table["name"].tolist() == ["K0", "K1"]
    assert table["x"].tolist() == [1.5, -2.0]
