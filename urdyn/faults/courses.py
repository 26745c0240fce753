"""Every course that a parameter may be on, each with its evidence: regressions of one unknown.

    change = pace x min(t - t0, lasts)^power

is a ramp that goes on (power 1), one that stopped, a step (power 0), what wears in or gathers speed
(other powers), and what grows in proportion to itself, which is a power without end. Given its
shape, the pace is a Gaussian that is cut off at zero, so that P(crossed within x) is known in
closed form; the posterior mixes these over all shapes and onsets. What is flat never crosses.

A bent course is not known by its past: from now on it may go straight on, or as hitherto, or
exponentially and at FASTER times the rate. So nothing bent is foretold as if it were straight.
Nor is what is straight in the long run only: besides there are ramps that wander on their way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from urdyn.errors import InputError
from urdyn.faults.futures import PARTS, Paces, Posterior, Smooth, Wandering
from urdyn.faults.onset import Kinks
from urdyn.faults.shapes import POWERS, RAMP, TIMES
from urdyn.faults.wander import STEPS, Walks
from urdyn.faults.whiten import Baseline
from urdyn.types import Array, Index

# Sliding wears in proportion to its way [Archard1953]_. Each share of what bends or wanders widens
# the intervals of what does not.
SHARES = (0.001, 0.01, 0.969, 0.01, 0.01)  # [-] prior probability of each power
UNEVEN = 0.02  # [-] prior odds of a ramp that wanders, over one that does not
ENDLESS, ALWAYS = 1e3, 0.01  # power that is an exponential's, and its prior probability
FASTER = 2.0  # [-] of the rate, by which what is bent may go on faster
NEGLIGIBLE = 1e-6  # [-] weight of a course
STEADY = 0.8  # [-] least variance of innovations that is believed, over the baseline's
PRIOR_STEPS = 30.0  # [steps] that the baseline's spread counts for, beside what was followed


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
    one, smooth, evenly = _even(baseline, state, stream, sign, rise, hazard)
    walks, pace, unevenly, otherwise = _uneven(baseline, state, stream, sign, rise)
    evidence = np.concatenate([evenly, unevenly])
    evidence += np.log(hazard)
    total = float(np.logaddexp.reduce(evidence))
    # A walk has no side: one that went the other way is no fault of this one, and explains as much.
    other = float(np.logaddexp.reduce(otherwise)) + np.log(hazard)
    healthy = np.logaddexp(np.log1p(-hazard) * state.t, other)
    begun = float(np.exp(total - np.logaddexp(total, healthy)))
    weight = np.exp(evidence - total)
    weight = np.where(weight > NEGLIGIBLE, weight, 0.0)
    even, uneven = np.split(weight / weight.sum(), [len(one.power)])
    return Posterior(_ahead(even, one, smooth), _walking(uneven, walks, pace, sign), begun)


def _even(
    baseline: Baseline, state: Kinks, stream: int, sign: float, rise: float, hazard: float
) -> tuple[Courses, Paces, Array]:
    """Courses that go as their shape says, of which something is told; paces, and log evidence."""
    kinds = (
        bent(state, stream), going(baseline, state, stream),
        stopped(baseline, state, stream, hazard), always(state, stream),
    )  # fmt: skip
    one = Courses(*map(np.concatenate, zip(*kinds, strict=True)))
    S1, S2 = levelled(baseline, state, stream, one)
    informed = (S2 > 0.0) & (one.prior > 0.0)
    one = Courses(*(x[informed] for x in one))
    paces, likely = _paces(sign * S1[informed], S2[informed], one.power, rise)
    return one, paces, likely + np.log(one.prior)


def _uneven(
    baseline: Baseline, state: Kinks, stream: int, sign: float, rise: float
) -> tuple[Walking, Paces, Array, Array]:
    """Ramps that wander; paces, and log evidence on the fault's side and on the other."""
    walks, besides = wandering(baseline, state, stream)
    paces, likely = _paces(sign * walks.S1, walks.S2, np.ones(len(walks.S1)), rise)
    likely, high = likely + besides, _height(walks, paces, sign)
    return walks, paces, likely + log_ndtr(high), likely + log_ndtr(-high)


def _paces(S1: Array, S2: Array, power: Array, rise: float) -> tuple[Paces, Array]:
    """Paces of regressions, and the evidence of each."""
    paces = Paces(S1 / S2, 1.0 / np.sqrt(S2))
    likely = 0.5 * (S1 * paces.mean + np.log(2.0 * np.pi / S2)) + paces.cut
    return paces, likely + _density(np.maximum(paces.mean, paces.sd), power, rise)


def levelled(baseline: Baseline, state: Kinks, stream: int, one: Courses) -> tuple[Array, Array]:
    """S1 and S2 at the spread that innovations have, without what the level's doubt explains.

    The baseline knows its level b to the variance kappa² / steps of theirs, whatever the course; 0
    where nothing is left.
    """
    wide = widened(state, stream)
    S1, S2, H = one.S1 / wide, one.S2 / wide, one.H / wide
    precision = _precision(baseline, state, stream) / wide
    left = S2 - H**2 / precision
    return S1 - H * state.E[stream] / wide / precision, np.where(left > 1e-9 * S2, left, 0.0)


def _precision(baseline: Baseline, state: Kinks, stream: int) -> float:
    """Of the level, by the baseline and what was followed, over that of one innovation."""
    return float(state.N[stream] + baseline.steps[stream] / baseline.inflation[stream] ** 2)


def widened(state: Kinks, stream: int) -> float:
    """Variance of innovations over that of healthy ones, as their differences tell."""
    squares, count = state.stride[:, stream]
    return max(STEADY, float((PRIOR_STEPS + squares) / (PRIOR_STEPS + count)))


def bent(state: Kinks, stream: int) -> Courses:
    """What goes on, of every power but a ramp's, from every onset that is remembered."""
    used, others = np.isfinite(state.onset), np.arange(len(POWERS)) != RAMP
    shape = (int(others.sum()), int(used.sum()))
    age = np.broadcast_to(state.t - state.onset[used], shape)
    power = np.broadcast_to(np.array(POWERS)[others, None], shape)
    sums = state.S[:, :, used, stream][:, others]
    prior = np.array(SHARES)[others, None] * state.mass[used]
    lasts = np.full(shape, np.inf)
    return Courses(*(x.ravel() for x in (*sums, age**power, age, lasts, power, prior)))


def going(baseline: Baseline, state: Kinks, stream: int) -> Courses:
    """Ramps that go on, from onsets between neighbours i and j that are remembered.

    Their h is w h_i + (1 - w) h_j, but for the few steps between the two. For neighbours are the
    further apart the older they are, whereas the onset of what has grown for long is told sharply.
    """
    onset = state.onset[np.isfinite(state.onset)]
    i = np.arange(len(onset))
    j = np.minimum(i + 1, i[-1])
    S1, S2, H = state.S[:, RAMP, :, stream]
    apart = onset[j] - onset[i] >= max(baseline.order, 1)
    w = np.where(apart, PARTS[:, None], np.round(PARTS)[:, None])  # nearer ones: either of the two
    both = _products(baseline, state, stream, i, j)
    S2 = w**2 * S2[i] + 2.0 * w * (1.0 - w) * both + (1.0 - w) ** 2 * S2[j]
    S1, H, age = (w * x[i] + (1.0 - w) * x[j] for x in (S1, H, state.t - onset))
    one = np.ones(w.shape)
    prior = one * np.diff(onset, append=state.t) * SHARES[RAMP] / len(PARTS)
    return Courses(*(x.ravel() for x in (S1, S2, H, age, age, np.inf * one, one, prior)))


def stopped(baseline: Baseline, state: Kinks, stream: int, hazard: float) -> Courses:
    """Ramps from an onset i that stopped at a later one j: h_i - h_j."""
    onset = state.onset[np.isfinite(state.onset)]
    between = onset - onset[:, None]
    i, j = np.nonzero(between >= max(baseline.order, 1))
    lasts = between[i, j]
    S1, S2, H = state.S[:, RAMP, :, stream]
    both = _products(baseline, state, stream, i, j)
    prior = hazard * SHARES[RAMP] * state.mass[i] * state.mass[j]
    power, age = np.ones(len(i)), state.t - onset[i]
    return Courses(
        S1[i] - S1[j], S2[i] - 2.0 * both + S2[j], H[i] - H[j], lasts, age, lasts, power, prior
    )


def _products(baseline: Baseline, state: Kinks, stream: int, i: Index, j: Index) -> Array:
    """Sum h_i h_j of ramps from an onset i and a later one j.

    Where j is as many steps behind i as the autoregression has lags, or more, h_i is a straight
    line by then, (1 - sum a) k + sum j a_j, of which the sums are kept. But not after a gap, whose
    products are kept themselves.
    """
    a = baseline.coefficients[stream]
    passed, lag = 1.0 - a.sum(), a @ np.arange(1.0, len(a) + 1.0)
    timed, plain = state.K[:, j, stream]
    both = passed * timed + (passed * (state.onset[j] - state.onset[i]) + lag) * plain
    return np.asarray(both + state.P[i, j, stream] if state.P.size else both)


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


def _ahead(weight: Array, one: Courses, pace: Paces) -> Smooth:
    """Courses that count; one that gathers speed has three futures, equally likely."""
    kept = weight > 0.0
    age, lasts, power, now = one.age[kept], one.lasts[kept], one.power[kept], one.now[kept]
    weight = weight[kept] / np.where(power > 1.0, 3.0, 1.0)
    haste = np.where(np.isinf(lasts), power / age, 0.0)
    bent = np.flatnonzero(power > 1.0)
    each = np.concatenate([np.arange(len(power)), bent, bent])
    straight, faster = np.ones(len(bent)), np.full(len(bent), ENDLESS)
    ahead = np.concatenate([np.where(power > 0.0, power, 1.0), straight, faster])
    hurried = np.concatenate([np.ones(len(power)), straight, FASTER * straight])
    return Smooth(
        weight[each],
        age[each],
        lasts[each],
        power[each],
        haste[each] * hurried,
        ahead,
        (now * pace.mean[kept])[each],
        (now * pace.sd[kept])[each],
    )


class Walking(NamedTuple):
    """Regressions on ramps that wander, (C,) each."""

    S1: Array
    S2: Array
    age: Array  # [steps]
    shape: Array  # [steps] what the level follows of a ramp now
    off: Array  # [spread] where the level is but for the ramp
    var: Array  # [spread²]
    walk: Array  # [spread²/step]


def wandering(baseline: Baseline, state: Kinks, stream: int) -> tuple[Walking, Array]:
    """Ramps that wander, and the log odds of each besides its regression's, its prior among them.

    u is passed times the level, `passed` what a lasting change leaves in innovations.
    """
    used = np.isfinite(state.onset)
    x = Walks(*state.walks[:, :, used, stream])
    wide, passed = widened(state, stream), 1.0 - baseline.coefficients[stream].sum()
    age = np.broadcast_to(state.t - state.onset[used], x.mean.shape)
    precision = _precision(baseline, state, stream)
    misfit = x.misfit + state.E[stream] ** 2 / precision
    odds = np.log(UNEVEN * SHARES[RAMP] / len(STEPS) * state.mass[used])
    odds = odds - 0.5 * (misfit / wide + x.width - np.log(precision))
    walk = np.broadcast_to(wide * STEPS[:, None] / passed**2, age.shape)
    shape, off, var = age - x.shape / passed, x.mean / passed, wide * x.var / passed**2
    one = Walking(x.S1 / wide, x.S2 / wide, age, shape, off, var, walk)
    informed = x.S2 > 0.0
    return Walking(*(each[informed] for each in one)), odds[informed]


def _height(one: Walking, pace: Paces, sign: float) -> Array:
    """How far above healthy the level is now, (C,) [its sd], on the side of the fault."""
    mean = sign * one.off + pace.mean * one.shape
    return np.asarray(mean / np.sqrt(one.var + (pace.sd * one.shape) ** 2))


def _walking(weight: Array, one: Walking, pace: Paces, sign: float) -> Wandering:
    """Of those that count."""
    kept = weight > 0.0
    return Wandering(
        weight[kept],
        one.age[kept],
        pace.mean[kept],
        pace.sd[kept],
        one.shape[kept],
        sign * one.off[kept],
        one.var[kept],
        one.walk[kept],
    )
