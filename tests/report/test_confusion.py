"""The drawing of what is taken for what."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.report.bench.confusion import confusion


def test_a_row_is_coloured_by_its_shares() -> None:
    drawing = confusion([[8, 2], [0, 5]], ["collision", "payload"], ["collision", "payload"])
    cells = drawing.data[0]
    np.testing.assert_allclose(cells.z, [[0.8, 0.2], [0.0, 1.0]])
    assert cells.text[1][0] == "" and cells.text[0][0] == "8"


def test_a_kind_that_never_happened_is_no_division_by_zero() -> None:
    assert (np.asarray(confusion([[0, 0]], ["a"], ["a", "b"]).data[0].z) == 0.0).all()


def test_rows_and_columns_have_to_be_named() -> None:
    with pytest.raises(AssertionError):
        confusion([[1, 2]], ["a"], ["a"])
