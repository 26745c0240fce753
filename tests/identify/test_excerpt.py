"""A part that stands for the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify.excerpt import WINDOWS, excerpt, folds
from urdyn.types import Motion


def test_a_short_motion_is_its_own_excerpt(motion: Motion) -> None:
    assert excerpt(motion, len(motion)) is motion


def test_an_excerpt_is_windows_from_the_first_row_to_the_last(motion: Motion) -> None:
    part = excerpt(motion, 600)
    assert len(part) == 600 and (part.t[0], part.t[-1]) == (motion.t[0], motion.t[-1])
    assert part.breaks == tuple(range(100, 600, 100)) and len(part.breaks) == WINDOWS - 1
    step = np.delete(np.diff(part.t), np.array(part.breaks) - 1)
    np.testing.assert_allclose(step, 0.01, rtol=1e-9)  # no gap but where a break tells of it
    at = np.searchsorted(motion.t, part.t)
    np.testing.assert_array_equal(part.current, motion.current[at])


def test_an_excerpt_keeps_the_gaps_that_fall_into_it(motion: Motion) -> None:
    part = excerpt(replace(motion, breaks=(50, 150)), 600)
    assert set(part.breaks) == {50, *range(100, 600, 100)}  # row 150 is in no window


@pytest.mark.parametrize("count", [2, 5, 7])
def test_folds_are_the_motion_cut(count: int, motion: Motion) -> None:
    parts = folds(motion, count)
    np.testing.assert_array_equal(np.concatenate([part.t for part in parts]), motion.t)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
