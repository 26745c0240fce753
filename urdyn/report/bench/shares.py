"""Shares and rates of counted events, with exact intervals."""

from __future__ import annotations

import numpy as np

from urdyn.report.digits import MISSING, percent


def interval(share: float, count: int, level: float = 0.95) -> tuple[float, float]:
    """Interval of the true share at this level: exact, by Clopper and Pearson."""
    from scipy.stats import binomtest

    known = binomtest(round(share * count), count).proportion_ci(level, method="exact")
    return float(known.low), float(known.high)


def share_of(share: float, count: int) -> str:
    """In percent, with its 95 % interval: "17 % (2 to 48)"."""
    if not count:
        return MISSING
    low, high = interval(share, count)
    return f"{percent(share)} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def rate_of(count: int, steps: int) -> str:
    """Events in 1000 steps, with a 95 % interval: "0 (0 to 0.023)"; exact, by Garwood."""
    if not steps:
        return MISSING
    from scipy.special import gammaincinv

    low = float(gammaincinv(count, 0.025)) if count else 0.0
    ends = 1000.0 / steps * np.array([count, low, gammaincinv(count + 1.0, 0.975)])
    return "{:.2g} ({:.2g} to {:.2g})".format(*ends)
