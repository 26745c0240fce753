"""When a growing change will reach its warning and critical levels, and its course until then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from urdyn.diagnose.findings.linear_trend import linear_trend
from urdyn.types import Array

DRAWS = 2000
NEVER = 1e9  # [s] counts as never, as where the rate may be zero
SURE = 3.0  # [sd] of a rate, below which nothing is forecast: it is tested at every block
FAN = (0.05, 0.25, 0.5, 0.75, 0.95)  # quantiles of a forecast
STEPS = 41  # times at which a forecast is given
BEYOND = 1.15  # [-] horizon of a forecast, over the upper end of the time to the critical level
FARTHEST = 2.5  # [-] the same over its median, where the upper end may be never
FEWEST = 4  # blocks that a trend needs
WALKED = 6.0 / 5.0  # [-] variance of the slope of a line through a walk, over walk² / time
BENT = 9.0  # [-] chi² by which a line that levels off must fit better


@dataclass(frozen=True)
class Course:
    """A change's present size and its rate; both are uncertain, and Gaussian."""

    t: float  # [s] time of that size
    size: float
    size_sd: float
    rate: float  # [1/s]
    rate_sd: float

    @property
    def grows(self) -> bool:
        """Whether it surely goes on in its direction; otherwise nothing is forecast."""
        return self._way * self.rate > SURE * self.rate_sd

    def until(self, level: float) -> dict[str, float]:
        """Median and 90 % interval of the time until |size| reaches `level` [s]; 0 if passed."""
        sizes, rates = self._draws
        left = (level - sizes) / np.where(rates > 0.0, rates, np.nan)
        left = np.where(sizes < level, np.fmin(left, NEVER), 0.0)
        lo, median, hi = (float(x) for x in np.quantile(left, [0.05, 0.5, 0.95]))
        return {"median": median, "lo": lo, "hi": hi}

    def forecast(self, warning: float, critical: float) -> dict[str, Any] | None:
        """The course as findings.json contains it; None where it may not be growing."""
        if not self.grows:
            return None
        left = self.until(critical)
        reach = min(BEYOND * left["hi"], FARTHEST * left["median"]) or self._past(critical)
        ahead = np.linspace(0.0, reach, STEPS)
        sizes, rates = self._draws
        fan = self._way * np.quantile(sizes + np.outer(ahead, rates), FAN, axis=1)
        return {
            "at_s": self.t,
            "ahead_s": ahead.tolist(),
            "quantiles": {f"{q:g}": row.tolist() for q, row in zip(FAN, fan, strict=True)},
            "warning": self._way * warning,
            "critical": self._way * critical,
            "to_warning_s": self.until(warning),
            "to_critical_s": left,
        }

    @property
    def _way(self) -> float:
        return float(np.sign(self.size) or 1.0)

    @cached_property
    def _draws(self) -> tuple[Array, Array]:
        """Sizes and rates (DRAWS,), positive in its direction."""
        z = np.random.default_rng(0).standard_normal((2, DRAWS))
        rates = self._way * self.rate + self.rate_sd * z[0]
        return self._way * self.size + self.size_sd * z[1], rates

    def _past(self, critical: float) -> float:
        """[s] horizon where the level is already passed: as far ahead as it is behind."""
        return max(abs(self.size) - critical, 0.1 * critical) / abs(self.rate)


def trend(
    series: Sequence[tuple[float, float, float]], onset: float, now: float, walk: float = 0.0
) -> Course | None:
    """Level at `now` [s] and slope of a series of (t, size, sd); None: it is too short.

    Args:
        walk: how far a size strays without a fault [1/√s].
    """
    rows: Array = np.array([row for row in series if row[0] > onset])
    if len(rows) < FEWEST:
        return None
    t, y, sd = rows.T
    line, end = linear_trend(t - now, y, sd), float(sd[-1])
    if line.ended > BENT:
        return Course(now, float(y[-1]), end, 0.0, 0.0)  # a step, or a ramp that is over
    strayed = walk * np.sqrt(WALKED / (t[-1] - t[0]))
    return Course(
        t=now,
        size=line.level,
        size_sd=float(np.hypot(end, line.level_sd)),
        rate=line.rate,
        rate_sd=float(np.hypot(line.rate_sd, strayed)),
    )
