"""Time until a level is crossed, with an interval of the stated coverage.

Medians and intervals are those of the mixture over all courses that the parameter may take
(`urdyn.faults.courses`): ramps from every onset, and courses that wander, stay flat, slow down or
accelerate, as far as the data support them. Where a level may never be crossed the upper limit is
infinite, and so is the median where that is likelier. Nothing is extrapolated without uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from urdyn.errors import InputError
from urdyn.faults.courses import posterior
from urdyn.faults.futures import Posterior
from urdyn.faults.onset import Kinks, followed
from urdyn.faults.whiten import Baseline, beside, given_baseline
from urdyn.given import fraction, given, given_a, given_number
from urdyn.types import Array

HAZARD = 1e-4  # prior probability of an onset, per step
COVERAGE = 0.9  # of an interval
BEYOND = 1e50  # [spread] beyond which squares overflow
FARTHEST = 1e9  # [steps] beyond which a crossing never comes


@dataclass(frozen=True)
class Interval:
    """Median and limits of something uncertain."""

    median: float
    low: float
    high: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Forecast:
    """The future of one parameter. Times in steps from the newest; negative: in the past."""

    probability: float  # [-] that a change has begun at all
    straight: float  # [-] if so, that it is an even ramp that goes on; if low, medians mean less
    onset: Interval  # [steps] when, if so
    rate: Interval  # [unit/step] if so
    change: Interval  # [unit] from the healthy level to where it is now; 0 if nothing has begun
    warning: Interval  # [steps] until the warning level, if so; inf: never
    critical: Interval  # [steps] until the critical level, if so; inf: never
    posterior: Posterior = field(repr=False)
    rise: float  # [spread] from the healthy to the critical level

    def health(self, horizon: float) -> float:
        """Probability that the critical level is not crossed within so many steps."""
        steps = given_number(horizon, "horizon", "a number of steps")
        return 1.0 - float(self.failed(steps)[0])

    def failed(self, steps: ArrayLike) -> Array:
        """Probability that the critical level is crossed within so many steps, (N,).

        For `decide(t, forecast.failed(t / step), costs)`, with step in hours and t from
        `outlook(costs)`; valid also where the level may never be crossed.
        """
        ahead = given(steps, "steps").tolist()
        known = [self.posterior.crossed(self.rise, x) for x in ahead]
        return self.probability * np.array(known)


def foresee(
    baseline: Baseline,
    state: Kinks,
    warning: ArrayLike,
    critical: ArrayLike,
    coverage: float = COVERAGE,
    hazard: float = HAZARD,
) -> tuple[Forecast, ...]:
    """Forecasts of n streams from their followed state; levels (n,) or one for all [unit]."""
    given_baseline(baseline)
    given_a(state, Kinks, "state", "as kinks and follow give")
    given(coverage, "coverage", "a number between 0 and 1", fraction)
    given(hazard, "hazard", "a number between 0 and 1", fraction)
    warn = given(warning, "warning level", streams=baseline.streams)
    fail = given(critical, "critical level", streams=baseline.streams)
    return tuple(
        _foreseen(
            baseline, state, stream, warning=near, critical=far, coverage=coverage, hazard=hazard
        )
        for stream, (near, far) in enumerate(zip(warn.tolist(), fail.tolist(), strict=True))
    )


def _foreseen(
    baseline: Baseline,
    state: Kinks,
    stream: int,
    *,
    warning: float,
    critical: float,
    coverage: float,
    hazard: float,
) -> Forecast:
    """The forecast of one stream."""
    typical, tail = float(baseline.typical[stream]), 0.5 * (1.0 - coverage)
    sign, spread = float(np.sign(critical - typical)), float(baseline.spread[stream])
    near, far = (sign * (level - typical) / spread for level in (warning, critical))
    if not 0.0 < near <= far < np.inf:
        raise InputError(
            f"stream {stream} is {typical:.4g} when healthy: warning level {warning:.4g} and "
            f"critical level {critical:.4g} have to lie on one side of that, finite, and the "
            "critical one no nearer"
        )
    known = posterior(baseline, state, stream, sign, far, hazard)

    def size(below: Callable[[float], float]) -> Interval:
        return _scaled(_quantiles(below, tail, 0.0, BEYOND), sign * spread)

    def time(level: float) -> Interval:
        return _quantiles(lambda x: known.crossed(level, x), tail, -float(state.t), FARTHEST)

    return Forecast(
        probability=known.begun,
        straight=known.straight,
        onset=_onset(known, tail, state.t),
        rate=size(lambda rate: 1.0 - known.steeper(rate)),
        change=size(lambda rise: 1.0 - known.begun * known.crossed(rise, 0.0)),
        warning=time(near),
        critical=time(far),
        posterior=known,
        rise=far,
    )


def forecast(
    series: ArrayLike,
    baseline: Baseline | ArrayLike,
    warning: ArrayLike,
    critical: ArrayLike,
    coverage: float = COVERAGE,
) -> tuple[Forecast, ...]:
    """When each stream will cross its levels, n forecasts.

    Args:
        series: (N,) or (N, n), what was measured since the baseline, at equal steps of time; NaN
            where a step has no reading.
        baseline: the same streams while healthy, 1000 steps or more; or what was learnt from them.
        warning: level of each stream [unit].
        critical: level of each stream [unit], beyond the warning level or equal to it; below the
            healthy level where the fault lowers the parameter.
        coverage: of the intervals, between 0 and 1.

    Raises:
        InputError: series and baseline have different streams, or a level cannot be used.

    Example: `forecast(friction, friction_when_new, 0.2, 0.25)[0].critical.median` is in steps.
    """
    rows, healthy = beside(series, baseline)
    away = np.abs(rows - healthy.typical) / healthy.spread
    if (np.isfinite(away) & (away > BEYOND)).any():
        raise InputError(
            f"the series is up to {np.nanmax(away):.0e} spreads from healthy: not its unit"
        )
    return foresee(healthy, followed(healthy, rows), warning, critical, coverage)


def health_index(forecasts: Sequence[Forecast], horizon: float) -> float:
    """Probability that no forecast parameter crosses its critical level within the horizon.

    For one joint or the whole arm, as the forecasts given are; parameters wear independently.
    """
    if isinstance(forecasts, Forecast) or not all(isinstance(x, Forecast) for x in forecasts):
        raise InputError(
            "a health index is of several forecasts: give all that `forecast` returned"
        )
    if not len(forecasts):
        raise InputError("a health index is of one forecast or more: there is none")
    return float(np.prod([one.health(horizon) for one in forecasts]))


def _onset(known: Posterior, tail: float, since: int) -> Interval:
    """Onset in steps from now, negative; no earlier than the first step followed."""
    age = np.minimum(known.age, since)
    order = np.argsort(-age)
    below = np.cumsum(known.weight[order])
    at = [-float(age[order][np.searchsorted(below, q * below[-1])])
          for q in (0.5, tail, 1.0 - tail)]  # fmt: skip
    return Interval(*at)


def _scaled(one: Interval, by: float) -> Interval:
    """The interval in another unit; its limits swap where `by` is negative."""
    low, high = sorted((by * one.low, by * one.high))
    return Interval(by * one.median, low, high)


def _quantiles(below: Callable[[float], float], tail: float, least: float, most: float) -> Interval:
    """Median and limits of x >= least with the distribution function `below`; inf past most."""

    def quantile(q: float) -> float:
        if below(least) >= q:
            return least
        step = 1.0
        while below(least + step) < q:
            step *= 2.0
            if step > most:
                return float("inf")
        return float(brentq(lambda x: below(x) - q, least, least + step, xtol=1e-9 * step))

    return Interval(quantile(0.5), quantile(tail), quantile(1.0 - tail))
