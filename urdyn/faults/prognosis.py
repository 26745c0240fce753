"""How long it will be until a level is crossed, with an interval that means what it says.

Of a ramp y = level + r (t - t0) the crossing of a level c comes at T = t0 + (c - level) / r. Given
the onset t0, r is a Gaussian that is cut off at zero, so that P(T < x) is known in closed form; the
posterior of T mixes these over all onsets. Nothing is extrapolated that is not uncertain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import log_ndtr

from urdyn.errors import InputError
from urdyn.faults.onset import Kinks, followed
from urdyn.faults.whiten import Baseline, beside
from urdyn.given import fraction, given
from urdyn.types import Array

HAZARD = 1e-4  # prior probability of an onset, per step
COVERAGE = 0.9  # of an interval
FARTHEST = 1e9  # [steps] from which a crossing never comes


@dataclass(frozen=True)
class Interval:
    """Median and limits of something uncertain."""

    median: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of one stream: every onset with its weight and its rate; [spread] is that of the baseline."""

    weight: Array  # (A,) [-] of the onsets, given that there is one; sums to 1
    age: Array  # (A,) [steps] since the onset
    mean: Array  # (A,) [spread/step] of the rate before it is cut off at zero, sign of the fault
    sd: Array  # (A,) [spread/step]
    begun: float  # [-] probability that there is an onset

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps | begun)."""
        since = self.age + x
        steep = rise / np.maximum(since, 1e-12)
        return float(self.weight @ np.where(since > 0.0, self._above(steep), 0.0))

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step] | begun)."""
        return float(self.weight @ self._above(rate))

    def _above(self, rate: Array | float) -> Array:
        """P(the rate is above `rate`) of every onset, (A,); in logarithms: both may be tiny."""
        beyond = log_ndtr((self.mean - rate) / self.sd) - log_ndtr(self.mean / self.sd)
        return np.asarray(np.exp(np.minimum(beyond, 0.0)))


@dataclass(frozen=True, eq=False)
class Forecast:
    """What one parameter is going to do. Times in steps from the newest; below zero: behind us."""

    probability: float  # [-] that something has begun at all
    onset: Interval  # [steps] when, if so
    rate: Interval  # [unit/step] if so
    change: Interval  # [unit] from the healthy level to where it is now, if anything has begun
    warning: Interval  # [steps] until the warning level, if so
    critical: Interval  # [steps] until the critical level, if so
    posterior: Posterior
    rise: float  # [spread] from the healthy to the critical level

    def health(self, horizon: float) -> float:
        """Probability that the critical level is not crossed within so many steps."""
        steps = float(given(horizon, "horizon")[0])
        crossed = self.probability * self.posterior.crossed(self.rise, steps)
        return min(max(1.0 - crossed, 0.0), 1.0)


def posterior(
    state: Kinks, stream: int, sign: float, rise: float, hazard: float = HAZARD
) -> Posterior:
    """Of the onset and rate of one stream.

    Args:
        sign: +1 where the fault lets the parameter rise, -1 where it falls.
        rise: [spread] up to the critical level, above 0: rates are taken for likely in its scale.
    """
    known = np.isfinite(state.onset) & (state.S2[:, stream] > 0.0)
    if not known.any():
        raise InputError("a forecast needs at least one measured step after the baseline")
    S2, S1 = state.S2[known, stream], sign * state.S1[known, stream]
    age = state.t - state.onset[known]
    mean, sd = S1 / S2, 1.0 / np.sqrt(S2)
    # Flat in the rate up to one that crosses in two steps, at a density that makes it proper.
    evidence = 0.5 * (S1 * mean - np.log(S2)) + log_ndtr(mean / sd) + np.log(2.0 * np.pi) / 2.0
    evidence += np.log(hazard * state.mass[known] * 2.0 / rise)
    total = float(np.logaddexp.reduce(evidence))
    begun = float(np.exp(total - np.logaddexp(total, np.log1p(-hazard) * state.t)))
    return Posterior(np.exp(evidence - total), age, mean, sd, begun)


def foresee(
    baseline: Baseline,
    state: Kinks,
    warning: ArrayLike,
    critical: ArrayLike,
    coverage: float = COVERAGE,
    hazard: float = HAZARD,
) -> tuple[Forecast, ...]:
    """Forecasts of n streams from what was followed; levels (n,) or one for all [unit]."""
    given(coverage, "coverage", "a number between 0 and 1", fraction)
    given(hazard, "hazard", "a number between 0 and 1", fraction)
    warn = given(warning, "warning level", streams=baseline.streams)
    fail = given(critical, "critical level", streams=baseline.streams)
    return tuple(
        _foreseen(baseline, state, stream, *levels, coverage, hazard)
        for stream, levels in enumerate(zip(warn.tolist(), fail.tolist(), strict=True))
    )


def _foreseen(
    baseline: Baseline,
    state: Kinks,
    stream: int,
    warning: float,
    critical: float,
    coverage: float,
    hazard: float,
) -> Forecast:
    """Of one stream."""
    typical, tail = float(baseline.typical[stream]), 0.5 * (1.0 - coverage)
    sign, spread = float(np.sign(critical - typical)), float(baseline.spread[stream])
    near, far = (sign * (level - typical) / spread for level in (warning, critical))
    if not 0.0 < near <= far < np.inf:
        raise InputError(
            f"stream {stream} is {typical:.4g} when healthy: warning level {warning:.4g} and "
            f"critical level {critical:.4g} have to lie on one side of that, finite, and the "
            "critical one no nearer"
        )
    known = posterior(state, stream, sign, far, hazard)
    back, begin = sign * spread, -float(state.t)
    return Forecast(
        known.begun,
        _onset(known, tail),
        _scaled(_quantiles(lambda rate: 1.0 - known.steeper(rate), tail, 0.0), back),
        _scaled(
            _quantiles(lambda rise: 1.0 - known.begun * known.crossed(rise, 0.0), tail, 0.0), back
        ),
        _quantiles(lambda x: known.crossed(near, x), tail, begin),
        _quantiles(lambda x: known.crossed(far, x), tail, begin),
        known,
        far,
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
        series: (N,) or (N, n), what was measured since the baseline.
        baseline: the same streams while healthy, 1000 steps or more; or what was learnt from them.
        warning: level of each stream [unit].
        critical: level of each stream [unit], beyond the warning level or equal to it; below the
            healthy level where the fault lets the parameter fall.
        coverage: of the intervals, between 0 and 1.

    Raises:
        InputError: series and baseline are of other streams, or a level cannot be used.

    Example: `forecast(friction, friction_when_new, 0.2, 0.25)[0].critical.median` is in steps.
    """
    rows, healthy = beside(series, baseline)
    return foresee(healthy, followed(healthy, rows), warning, critical, coverage)


def health_index(forecasts: Sequence[Forecast], horizon: float) -> float:
    """Probability that none of the forecast parameters crosses its critical level so soon.

    Of one joint or of the whole arm, as the forecasts given are; parameters wear independently.
    """
    return float(np.prod([one.health(horizon) for one in forecasts]))


def _onset(known: Posterior, tail: float) -> Interval:
    """Steps from now, below zero."""
    order = np.argsort(-known.age)
    below = np.cumsum(known.weight[order])
    at = [-float(known.age[order][np.searchsorted(below, q * below[-1])])
          for q in (0.5, tail, 1.0 - tail)]  # fmt: skip
    return Interval(*at)


def _scaled(one: Interval, by: float) -> Interval:
    """In another unit; limits change places where its sign is another."""
    low, high = sorted((by * one.low, by * one.high))
    return Interval(by * one.median, low, high)


def _quantiles(below: Callable[[float], float], tail: float, least: float) -> Interval:
    """Median and limits of x >= least with the distribution function `below`."""

    def quantile(q: float) -> float:
        if below(least) >= q:
            return least
        step = 1.0
        while below(least + step) < q:
            step *= 2.0
            if step > FARTHEST:
                return float("inf")
        return float(brentq(lambda x: below(x) - q, least, least + step, xtol=1e-9 * step))

    return Interval(quantile(0.5), quantile(tail), quantile(1.0 - tail))
