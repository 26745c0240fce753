"""Evaluation: expected cost of servicing a joint now, later, or not at all.

The step phi_evaluation of the network [Kapteyn2021]_, by age replacement [Barlow1965]_ over a
horizon H: with tau the time at which a growing fault ends the work, and a service at T,

    C(T) = c(T) P(tau > T) + c_f P(tau <= T) + (c_s / L) E[H - min(tau, T)],

where c(T) is the cost of stopping the work while T is within the notice that a plant needs, and
that of a planned service, c_s, afterwards; every hour that the new part runs before H uses up 1 / L
of the next service. Not servicing costs c_f P(tau <= H) + (c_s / L) E[(H - tau)+]. Failures without
warning happen whatever is decided, and are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given, given_a, given_number, positive
from urdyn.types import NORMAL90, Array

STEPS = 400  # times at which a later service may fall, and as many before
SOON = 1e-9  # [h]
ALIKE = 1.0 + 1e-6  # ratio of times that are equal but for rounding


@dataclass(frozen=True)
class Costs:
    """An owner's costs, in any one unit, and times."""

    service: float = 1.0  # planned, all included
    stop: float = 2.0  # the same at once, in the middle of the work
    failure: float = 10.0  # unplanned, downtime included
    notice: float = 24.0  # [h] after which a service counts as planned
    life: float = 20_000.0  # [h] of a serviced joint
    horizon: float = 2_000.0  # [h] over which the three choices are compared

    def __post_init__(self) -> None:
        for field in fields(self):
            given(getattr(self, field.name), field.name, "a number above 0", positive)
        if self.notice >= self.horizon:
            raise InputError("the horizon is to be longer than the notice")


@dataclass(frozen=True)
class Decision:
    """Expected costs, and the cheapest of the three."""

    now: float
    later: float  # at the best moment
    later_at: float  # [h] from now
    never: float

    @property
    def advice(self) -> str:
        """ "now", "later" or "never"."""
        least = min(self.never, self.later, self.now)
        if self.never == least:
            return "never"
        return "now" if self.now == least else "later"


def decide(t: Array, failed: Array, costs: Costs | None = None) -> Decision:
    """Expected costs of the three choices for a joint.

    Args:
        t: times from now, ascending from 0, (N,) [h]; the last is the horizon.
        failed: probability of a failure by then, (N,), not falling. The joint is at work: what is
            due by time 0 comes at once, and a service now forestalls it.

    Raises:
        InputError: they do not fit each other, or end before a service counts as planned.
    """
    costs = _given_costs(Costs() if costs is None else costs)
    t = given(t, "times", "hours from 0, ascending", lambda x: np.diff(x, prepend=-1.0) > 0.0)
    failed = given(failed, "failed", "probabilities that do not fall", _not_falling)
    if len(t) != len(failed):
        raise InputError(f"there are {len(t)} times and {len(failed)} probabilities; give as many")
    if not len(t) or t[0] != 0.0 or t[-1] < costs.notice:
        raise InputError(f"times have to reach from 0 to the notice of {costs.notice:g} h at least")
    failed = np.concatenate([[0.0], failed[1:]])
    survived = 1.0 - failed
    lived = np.concatenate([[0.0], np.cumsum(np.diff(t) * 0.5 * (survived[1:] + survived[:-1]))])
    renewed = costs.service / costs.life * (t[-1] - lived)  # by T: E min(tau, T) is lived
    serviced = np.where(t < costs.notice, costs.stop, costs.service)
    at = serviced * survived + costs.failure * failed + renewed
    never = costs.failure * failed[-1] + renewed[-1]
    planned = int(np.searchsorted(t, costs.notice))
    best = planned + int(np.argmin(at[planned:]))
    return Decision(float(at[0]), float(at[best]), float(t[best]), float(never))


def outlook(
    costs: Costs, confidence: float = 0.0, median: float = np.inf, lo: float = 0.0, hi: float = 0.0
) -> tuple[Array, Array]:
    """Times over the horizon [h], and the probability of a failure by then, (N,) each.

    With this confidence a fault grows, and is forecast to end the work at `median` [h], 90 %
    between `lo` and `hi`, normal before the median and log-normal after it. An infinite median
    without limits: nothing is forecast.

    Raises:
        InputError: they are no such times, or may never come: `Forecast.failed` handles those.
    """
    _given_costs(costs)
    given(confidence, "confidence", "a probability", lambda x: (x >= 0.0) & (x <= 1.0))
    median, lo, hi = (
        _from_now(x, what) for x, what in ((median, "median"), (lo, "lo"), (hi, "hi"))
    )
    if median < 0.0:
        raise InputError(f"median {median}, lo {lo}, hi {hi}: give times from now [h]")
    if lo > ALIKE * median or 0.0 != hi < median / ALIKE:
        raise InputError(f"median {median}, lo {lo}, hi {hi}: they have to ascend from lo to hi")
    if hi == np.inf or (median == np.inf and lo > 0.0):
        raise InputError(
            f"median {median}, lo {lo}, hi {hi}: what may never come has no such distribution; "
            "give decide what Forecast.failed tells"
        )
    early = np.linspace(0.0, costs.notice, STEPS, endpoint=False)
    t = np.concatenate([early, np.linspace(costs.notice, costs.horizon, STEPS + 1)])
    if not np.isfinite(median):
        return t, np.zeros(len(t))
    return t, confidence * _by(t, max(median, SOON), lo, hi)


def _given_costs(costs: object) -> Costs:
    """An owner's costs; InputError where it is something else."""
    return given_a(costs, Costs, "costs", "as Costs(failure=10.0) gives")


def _not_falling(failed: Array) -> Array:
    """Whether each is a probability, and none less than the one before, but for rounding."""
    return np.asarray((failed >= 0.0) & (failed <= 1.0) & (np.diff(failed, prepend=0.0) >= -1e-9))


def _from_now(time: float, what: str) -> float:
    """A time [h]; inf: never."""
    if isinstance(time, float) and time == np.inf:
        return time
    return given_number(time, what, "a time from now [h]")


def _by(t: Array, median: float, lo: float, hi: float) -> Array:
    """Distribution of a half normal and a half log-normal that meet at the median, (N,).

    A failure due soon may come at once, lo = 0, which no log-normal reaches.
    """
    from scipy.special import ndtr

    early = max((median - lo) / NORMAL90, 1e-6 * median)
    late = max(np.log(max(hi, median) / median) / NORMAL90, 1e-6)
    before, after = np.minimum(t - median, 0.0), np.log(np.maximum(t / median, 1.0))
    return np.asarray(ndtr(before / early + after / late))
