"""Shares of few lives are told no surer than they make them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from urdyn.report.bench.shares import interval, share_of


def test_two_of_twelve_are_told_with_what_they_may_be_of() -> None:
    assert share_of(2 / 12, 12) == "17 % (2 to 48)"
    assert share_of(1.0, 2) == "100 % (16 to 100)"
    assert share_of(float("nan"), 0) == "–"


@pytest.mark.parametrize("share", [0.05, 0.3, 0.9])
def test_an_interval_holds_the_share_as_often_as_it_says(share: float) -> None:
    """Summed over all that may come of 30 lives, not drawn."""
    hits = np.arange(31)
    inside = [low <= share <= high for low, high in (interval(k / 30, 30) for k in hits)]
    assert binom.pmf(hits, 30, share)[inside].sum() >= 0.95
