"""Uncertainty of figures over few arms: arms are independent, joints of one arm are not.

A share p over arms of d joints each has the Clopper-Pearson interval for as many independent draws
as would scatter like these arms [Korn1998]_,

    n = min(arms d, p (1 - p) / var(p) (t(arms d - 1) / t(arms - 1))²)

which is never a point: two arms that happen to agree show 2 d joints, not certainty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import beta
from scipy.stats import t as student

from urdyn.types import Array

TWO_SIDED = 0.975  # [-] quantile of the upper end of 95 % intervals


def scatter(values: Sequence[float]) -> float:
    """Standard error of the mean; NaN for one arm."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else np.nan


def rms(x: Array) -> float:
    """Root of a mean of squares."""
    return float(np.sqrt(np.mean(x**2)))


def of_root(squares: Sequence[float]) -> float:
    """Standard error of the root of a mean of squares, to first order."""
    root = float(np.sqrt(np.mean(squares)))
    return scatter(squares) / (2.0 * root) if root else np.nan


def reach(arms: int) -> float:
    """Half width of the 95 % interval of a mean over arms, in standard errors."""
    return float(student.ppf(TWO_SIDED, arms - 1)) if arms > 1 else np.inf


def interval(shares: Sequence[float], each: int) -> tuple[float, float]:
    """95 % interval of a share, from each arm's share over `each` joints; NaN for one arm."""
    arms, share, sd = len(shares), float(np.mean(shares)), scatter(shares)
    if not np.isfinite(sd):
        return np.nan, np.nan
    count = float(arms * each)
    if sd > 0.0:
        wider = reach(arms * each) / reach(arms)
        count = min(count, share * (1.0 - share) / sd**2 * wider**2)
    hits = share * count
    low = float(beta.ppf(1.0 - TWO_SIDED, hits, count - hits + 1.0)) if hits > 0.0 else 0.0
    missed = hits < count
    return low, float(beta.ppf(TWO_SIDED, hits + 1.0, count - hits)) if missed else 1.0
