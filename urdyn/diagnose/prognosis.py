"""When a change that grows will reach the level that it must not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.types import Array

DRAWS = 2000
NEVER = 1e9  # [s] a rate that may as well be nothing
SURE = 2.0  # [sd] of a rate, below which nothing is said


def time_left(
    size: float, size_sd: float, rate: float, rate_sd: float, critical: float
) -> dict[str, float] | None:
    """Median and 90 % interval of the time until |size| reaches `critical` [s].

    None where it may as well not grow. A level that is passed has 0 left.
    """
    way = np.sign(size) or 1.0
    rate, size = way * rate, way * size
    if rate <= SURE * rate_sd or rate <= 0.0:
        return None
    rng = np.random.default_rng(0)
    z = rng.standard_normal((2, DRAWS))
    rates = rate + rate_sd * z[0]
    left = (critical - (size + size_sd * z[1])) / np.where(rates > 0.0, rates, np.nan)
    left = np.where(np.isnan(left), NEVER, np.clip(left, 0.0, NEVER))
    lo, median, hi = (float(x) for x in np.quantile(left, [0.05, 0.5, 0.95]))
    return {"median": median, "lo": lo, "hi": hi}


def trend(
    series: Sequence[tuple[float, float, float]], onset: float
) -> tuple[float, float, float, float]:
    """Level and slope at the end of a series of (t, size, sd) since its onset, with their sds.

    Neighbours of a filter's belief err alike, so the slope's sd is that of two ends.
    """
    rows: Array = np.array([row for row in series if row[0] > onset])
    if len(rows) < 4:
        return (series[-1][1], series[-1][2], 0.0, np.inf) if series else (0.0, 0.0, 0.0, np.inf)
    t, y, sd = rows.T
    u = t - t[-1]
    w = 1.0 / sd**2
    X = np.stack([np.ones_like(u), u], axis=1)
    M = X.T @ (w[:, None] * X)
    level, slope = np.linalg.solve(M, X.T @ (w * y))
    scatter = float(np.sqrt(np.mean((y - X @ [level, slope]) ** 2)))
    end = float(np.hypot(sd[-1], scatter))
    return float(level), end, float(slope), float(np.sqrt(2.0) * end / (t[-1] - t[0]))
