"""Shares of few lives are told no surer than they make them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, poisson

from urdyn.report.bench.shares import interval, rate_of, share_of


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


def test_a_rate_is_told_with_what_it_may_be_of() -> None:
    assert rate_of(0, 0) == "–"
    assert rate_of(0, 1000) == "0 (0 to 3.7)"  # that none come of 3.7 expected: one in forty
    assert poisson.pmf(0, 3.689) == pytest.approx(0.025, rel=1e-3)
    assert rate_of(4, 2000) == "2 (0.54 to 5.1)"
    assert poisson.cdf(4, 2 * 5.121) == pytest.approx(0.025, rel=5e-3)
    assert poisson.sf(3, 2 * 0.545) == pytest.approx(0.025, rel=5e-3)
