"""TOML reads back as it was written, and a broken document is told by file and line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdyn.errors import TwinError
from urdyn.io import dump_toml, load_toml

texts = st.text(st.characters(exclude_categories=["Cs"]))
scalars = texts | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
values = st.recursive(scalars, lambda inner: st.lists(inner, max_size=3), max_leaves=9)
documents = st.recursive(
    st.dictionaries(texts, values, max_size=3),
    lambda inner: st.dictionaries(
        texts, values | inner | st.lists(inner, min_size=1, max_size=2), max_size=3
    ),
    max_leaves=5,
)


@given(document=documents)
def test_a_document_reads_back_as_it_was_written(document: dict[str, Any]) -> None:
    assert tomllib.loads(dump_toml(document)) == document


def test_a_matrix_is_one_row_a_line() -> None:
    text = dump_toml({"fit": {"cov": np.eye(2), "names": ["a", "b"], "n": np.int64(3)}})
    assert text == ('[fit]\ncov = [\n  [1.0, 0.0],\n  [0.0, 1.0],\n]\nnames = ["a", "b"]\nn = 3\n')


def test_special_floats_keep_their_meaning() -> None:
    back = tomllib.loads(dump_toml({"x": [np.nan, np.inf, -np.inf, np.float64(0.1)]}))
    np.testing.assert_array_equal(back["x"], [np.nan, np.inf, -np.inf, 0.1])


def test_what_toml_has_no_word_for_is_our_mistake() -> None:
    with pytest.raises(TypeError, match="NoneType"):
        dump_toml({"x": None})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a = 1\nb = = 2\n", r"twin.toml:2: not TOML: Invalid value$"),
        (b"a = 1\nb = '\xff'\n", "twin.toml:2: not UTF-8 text"),
        (b"a = 1\na = 2\n", "twin.toml:2: not TOML"),
        (b"a = [", "twin.toml: not TOML"),
        (b"a = " + b"[" * 5000, "twin.toml: not TOML"),
        (b"a = " + b"1" * 5000, "twin.toml: not TOML: Exceeds the limit"),
    ],
)
def test_a_broken_document_is_told_by_its_line(
    content: bytes, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "twin.toml"
    path.write_bytes(content)
    with pytest.raises(TwinError, match=message):
        load_toml(path, TwinError)


def test_a_byte_order_mark_is_no_part_of_a_document(tmp_path: Path) -> None:
    path = tmp_path / "twin.toml"
    path.write_text("a = 1\n", encoding="utf-8-sig")
    assert load_toml(path) == {"a": 1}


def test_a_missing_document_is_told(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="cannot be read: No such file"):
        load_toml(tmp_path / "twin.toml", TwinError)


def test_of_a_folder_the_file_that_may_be_meant_is_told(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match=r"is a folder; name a file in it$"):
        load_toml(tmp_path, TwinError)
    (tmp_path / "twin.toml").touch()
    with pytest.raises(TwinError, match=r"is a folder; name a file in it, like .*/twin\.toml$"):
        load_toml(tmp_path, TwinError)
