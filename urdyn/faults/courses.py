"""Every course that a parameter may be on, each with its evidence: regressions of one unknown.

    change = pace x min(t - t0, lasts)^power

is a ramp that goes on (power 1), one that stopped, a step (power 0), what wears in or gathers speed
(other powers), and what grows in proportion to itself, which is a power without end. Given its
shape, the pace is a Gaussian that is cut off at zero, so that P(crossed within x) is known in
closed form; the posterior mixes these over all shapes and onsets. What is flat never crosses.

A bent course is not known by its past: from now on it may go straight on, or as hitherto, or
exponentially and at HASTE times the rate. So what is not straight is not foretold as if it were.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from urdyn.errors import InputError
from urdyn.faults.onset import POWERS, TIMES, Kinks
from urdyn.faults.whiten import Baseline
from urdyn.types import Array

RAMP = POWERS.index(1.0)
SHARES = (0.001, 0.01, 0.969, 0.01, 0.01)  # [-] prior probability of each power: wear grows evenly
ENDLESS, ALWAYS = 1e3, 0.01  # power that is an exponential's, and its prior probability
HASTE = 2.0  # [-] by which what is bent may go faster than its past tells
TINY, LARGE = 1e-100, 600.0  # times as large as now; nats
NEGLIGIBLE = 1e-6  # [-] weight of a course
STEADY = 0.8  # [-] least variance of innovations that is believed, over the baseline's
WONT = 30.0  # [steps] for which the spread is believed to be the baseline's


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of one stream: C courses with their weights and changes; [spread] is the baseline's."""

    weight: Array  # (C,) [-] of the courses, given that there is one; sums to 1
    age: Array  # (C,) [steps] since the onset t0
    lasts: Array  # (C,) [steps] from the onset on until it stopped; inf: it goes on
    power: Array  # (C,) [-]
    haste: Array  # (C,) [1/step] rate from now on, over the change
    ahead: Array  # (C,) [-] power from now on
    mean: Array  # (C,) [spread] of the change now before it is cut off at zero, sign of the fault
    sd: Array  # (C,) [spread]
    begun: float  # [-] probability that there is an onset

    @property
    def straight(self) -> float:
        """P(it is a ramp that goes on | begun) [-]."""
        return float(self.weight @ ((self.power == 1.0) & np.isinf(self.lasts)))

    def crossed(self, rise: float, x: float) -> float:
        """P(the parameter has changed by `rise` [spread] within the next x steps | begun)."""
        if x > 0.0:
            grown = self.ahead * np.log1p(self.haste * x / self.ahead)
            return self._above(rise, np.exp(np.minimum(grown, LARGE)))
        k = np.minimum(self.age + x, self.lasts) / np.minimum(self.age, self.lasts)
        return self._above(rise, np.where(k > 0.0, np.maximum(k, 0.0) ** self.power, 0.0))

    def steeper(self, rate: float) -> float:
        """P(the rate is above `rate` >= 0 [spread/step] | begun)."""
        return self._above(rate, self.haste)

    def _above(self, level: float, times: Array) -> float:
        """P(the change, so many times as large, (C,), is above a level | begun)."""
        there = times > TINY
        least = level / np.where(there, times, 1.0)
        # In logarithms: both may be tiny.
        beyond = log_ndtr((self.mean - least) / self.sd) - self._cut
        return float(self.weight @ np.where(there, np.exp(np.minimum(beyond, 0.0)), 0.0))

    @cached_property
    def _cut(self) -> Array:
        """ln P(the change is above zero), (C,), of the Gaussian."""
        return np.asarray(log_ndtr(self.mean / self.sd))


class Courses(NamedTuple):
    """Regressions on shapes, (C,) each."""

    S1: Array  # sum of shape x innovation
    S2: Array  # sum of shape²
    H: Array  # sum of shape
    now: Array  # what the shape is now
    age: Array  # [steps]
    lasts: Array  # [steps]
    power: Array  # [-]
    prior: Array  # [-]


def posterior(
    baseline: Baseline, state: Kinks, stream: int, sign: float, rise: float, hazard: float
) -> Posterior:
    """Of the course of one stream.

    Args:
        sign: +1 where the fault lets the parameter rise, -1 where it falls.
        rise: [spread] up to the critical level, above 0: paces are taken for likely in its scale.
        hazard: prior probability of an onset, and of a stop, per step.
    """
    if not state.N[stream] > 0.0:
        raise InputError("a forecast needs at least one measured step after the baseline")
    kinds = going(state, stream), stopped(baseline, state, stream, hazard), always(state, stream)
    one = Courses(*map(np.concatenate, zip(*kinds, strict=True)))
    S1, S2 = levelled(baseline, state, stream, one)
    told = (S2 > 0.0) & (one.prior > 0.0)
    S1, S2, one = sign * S1[told], S2[told], Courses(*(x[told] for x in one))
    mean, sd = S1 / S2, 1.0 / np.sqrt(S2)
    evidence = 0.5 * (S1 * mean + np.log(2.0 * np.pi / S2)) + log_ndtr(mean / sd)
    evidence += np.log(hazard * one.prior) + _density(np.maximum(mean, sd), one.power, rise)
    total = float(np.logaddexp.reduce(evidence))
    begun = float(np.exp(total - np.logaddexp(total, np.log1p(-hazard) * state.t)))
    return _ahead(np.exp(evidence - total), one, one.now * mean, one.now * sd, begun)


def levelled(baseline: Baseline, state: Kinks, stream: int, one: Courses) -> tuple[Array, Array]:
    """S1 and S2 at the spread that innovations have, without what the level's doubt explains.

    The baseline knows its level b to the variance kappa² / steps, whatever the course; 0 where
    nothing is left.
    """
    wide = widened(state, stream)
    S1, S2, H = one.S1 / wide, one.S2 / wide, one.H / wide
    precision = state.N[stream] / wide + baseline.steps / baseline.inflation[stream] ** 2
    left = S2 - H**2 / precision
    return S1 - H * state.E[stream] / wide / precision, np.where(left > 1e-9 * S2, left, 0.0)


def widened(state: Kinks, stream: int) -> float:
    """Variance of innovations over that of healthy ones, as their differences tell."""
    squares, told = state.stride[:, stream]
    return max(STEADY, float((WONT + squares) / (WONT + told)))


def going(state: Kinks, stream: int) -> Courses:
    """What goes on, of every power, from every onset."""
    used = np.isfinite(state.onset)
    shape = (len(POWERS), int(used.sum()))
    age = np.broadcast_to(state.t - state.onset[used], shape)
    power = np.broadcast_to(np.array(POWERS)[:, None], shape)
    sums = state.S[:, :, used, stream]
    prior = np.array(SHARES)[:, None] * state.mass[used]
    lasts = np.full(shape, np.inf)
    return Courses(*(x.ravel() for x in (*sums, age**power, age, lasts, power, prior)))


def stopped(baseline: Baseline, state: Kinks, stream: int, hazard: float) -> Courses:
    """Ramps from an onset i that stopped at a later one j: h_i - h_j.

    S2 needs sum h_i h_j. Where j is as many steps behind i as the autoregression has lags, or more,
    h_i is a straight line by then, (1 - sum a) k + sum j a_j, of which the sums are kept.
    """
    onset = state.onset[np.isfinite(state.onset)]
    between = onset - onset[:, None]
    i, j = np.nonzero(between >= max(baseline.order, 1))
    lasts = between[i, j]
    S1, S2, H = state.S[:, RAMP, :, stream]
    a = baseline.coefficients[stream]
    passed, lag = 1.0 - a.sum(), a @ np.arange(1.0, len(a) + 1.0)
    both = passed * state.K[j, stream] + (passed * lasts + lag) * H[j]
    prior = hazard * SHARES[RAMP] * state.mass[i] * state.mass[j]
    power, age = np.ones(len(i)), state.t - onset[i]
    return Courses(
        S1[i] - S1[j], S2[i] - 2.0 * both + S2[j], H[i] - H[j], lasts, age, lasts, power, prior
    )


def always(state: Kinks, stream: int) -> Courses:
    """Exponentials, which have no onset: as large as the noise at one step or another.

    But not without the time to grow twice e-fold since.
    """
    one, (S1, S2, H) = np.ones(len(TIMES)), state.X[:, :, stream]
    prior = ALWAYS / len(TIMES) * np.where(state.t > 2.0 * TIMES, TIMES, 0.0)
    return Courses(S1, S2, H, one, ENDLESS * TIMES, np.inf * one, ENDLESS * one, prior)


def _density(pace: Array, power: Array, rise: float) -> Array:
    """Log prior density of paces: the critical level is D > 2 steps from the onset, p(D) = 2 / D².

    Which is flat in the rate of a ramp. Steps are flat up to the level; exponentials were as large
    as the noise at no step rather than another, and have grown since.
    """
    g = np.where((power > 0.0) & (power < ENDLESS), power, 1.0)
    known = np.log(2.0 / (g * rise)) + (1.0 - 1.0 / g) * np.log(rise / pace)
    faster = -np.log(np.maximum(pace, 1.0))
    return np.select([power == 0.0, power < ENDLESS], [-np.log(rise), known], faster)


def _ahead(weight: Array, one: Courses, mean: Array, sd: Array, begun: float) -> Posterior:
    """Courses that count; one that gathers speed has three futures, equally likely."""
    kept = weight > NEGLIGIBLE
    age, lasts, power = one.age[kept], one.lasts[kept], one.power[kept]
    weight = weight[kept] / weight[kept].sum() / np.where(power > 1.0, 3.0, 1.0)
    haste = np.where(np.isinf(lasts), power / age, 0.0)
    bent = np.flatnonzero(power > 1.0)
    each = np.concatenate([np.arange(len(power)), bent, bent])
    straight, faster = np.ones(len(bent)), np.full(len(bent), ENDLESS)
    ahead = np.concatenate([np.where(power > 0.0, power, 1.0), straight, faster])
    hurried = np.concatenate([np.ones(len(power)), straight, HASTE * straight])
    return Posterior(
        weight[each],
        age[each],
        lasts[each],
        power[each],
        haste[each] * hurried,
        ahead,
        mean[kept][each],
        sd[kept][each],
        begun,
    )
