"""How far a figure over few arms can be trusted: arms are independent, what is within one is not.

A share p over arms of d joints each has Clopper and Pearson's interval of as many independent
draws as would scatter like these arms [Korn1998]_,

    n = min(arms d, p (1 - p) / var(p) (t(arms d - 1) / t(arms - 1))²)

which is never a point: two arms that happen to agree have shown 2 d joints, not certainty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import beta
from scipy.stats import t as student

from urdyn.types import Array

TWO_SIDED = 0.975  # [-] quantile of both ends of 95 % intervals


def scatter(values: Sequence[float]) -> float:
    """Standard deviation of their mean; NaN of one arm, which does not tell."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else np.nan


def rms(x: Array) -> float:
    """Root of a mean of squares."""
    return float(np.sqrt(np.mean(x**2)))


def of_root(squares: Sequence[float]) -> float:
    """Standard deviation of the root of a mean of squares, to first order."""
    root = float(np.sqrt(np.mean(squares)))
    return scatter(squares) / (2.0 * root) if root else np.nan


def reach(arms: int) -> float:
    """Standard deviations of a mean over so many arms to the end of its 95 % interval."""
    return float(student.ppf(TWO_SIDED, arms - 1)) if arms > 1 else np.inf


def interval(shares: Sequence[float], each: int) -> tuple[float, float]:
    """95 % interval of a share, of which every arm shows one over `each` joints; NaN of one arm."""
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
