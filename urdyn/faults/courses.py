"""Every course that a parameter may take, with its evidence: regressions with one unknown.

    change = pace x min(t - t0, lasts)^power

is a ramp that goes on or has stopped (power 1), a step (power 0), wear that slows down or
accelerates (other powers), or exponential growth, the limit of large powers. Given its shape, the
pace is a Gaussian truncated at zero, so that P(crossed within x) has a closed form; the posterior
mixes these over all shapes and onsets. A flat course never crosses.

The past of an accelerating course does not determine its future: it may go on straight, as before,
or exponentially at FASTER times the rate. So no curved course is forecast as if it were straight.
Nor is one that is straight only in the long run: there are also ramps that wander.
"""

from __future__ import annotations

from dataclasses import dataclass
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

# Sliding wear is proportional to the distance slid [Archard1953]_. Each share given to curved or
# wandering courses widens the intervals of straight ones.
SHARES = (0.001, 0.01, 0.969, 0.01, 0.01)  # [-] prior probability of each power
UNEVEN = 0.02  # [-] prior odds of a ramp that wanders, over one that does not
ENDLESS, ALWAYS = 1e3, 0.01  # power that stands for an exponential, and its prior probability
FASTER = 2.0  # [-] of the rate, at which an accelerating course may go on
NEGLIGIBLE = 1e-6  # [-] weight of a course
STEADY = 0.8  # [-] least credible variance of innovations, over the baseline's
PRIOR_STEPS = 30.0  # [steps] weight of the baseline's spread against what was followed


@dataclass(frozen=True, eq=False)
class Stream:
    """One stream as it was followed, with the A onsets in use; sums are those of `Kinks`."""

    t: int  # [steps] so far
    a: Array  # (p,) its autoregression
    onset: Array  # (A,) [step]
    mass: Array  # (A,) [steps]
    S: Array  # (3, G, A)
    K: Array  # (2, A)
    P: Array  # (A, A); (0, 0): nothing was missing
    X: Array  # (3, T)
    E: float
    walks: Walks  # (Q, A) each
    wide: float  # [-] variance of innovations over that of healthy ones
    precision: float  # of the level, from baseline and data, over that of one innovation

    @property
    def passed(self) -> float:
        """Share of a lasting change that is left in innovations [-]."""
        return 1.0 - float(self.a.sum())


def stream_of(baseline: Baseline, state: Kinks, stream: int) -> Stream:
    """One of the streams that were followed."""
    used = np.isfinite(state.onset)
    return Stream(
        t=state.t,
        a=baseline.coefficients[stream],
        onset=state.onset[used],
        mass=state.mass[used],
        S=state.S[:, :, used, stream],
        K=state.K[:, used, stream],
        P=state.P[:, :, stream],
        X=state.X[:, :, stream],
        E=state.E[stream],
        walks=Walks(*state.walks[:, :, used, stream]),
        wide=_widened(state, stream),
        precision=float(state.N[stream] + baseline.steps[stream] / baseline.inflation[stream] ** 2),
    )


def _widened(state: Kinks, stream: int) -> float:
    """Variance of innovations over that of healthy ones, estimated from their differences."""
    squares, count = state.stride[:, stream]
    return max(STEADY, float((PRIOR_STEPS + squares) / (PRIOR_STEPS + count)))


class Courses(NamedTuple):
    """Regressions on shapes, (C,) each."""

    S1: Array  # sum of shape x innovation
    S2: Array  # sum of shape²
    H: Array  # sum of shape
    now: Array  # present value of the shape
    age: Array  # [steps]
    lasts: Array  # [steps]
    power: Array  # [-]
    prior: Array  # [-]


def posterior(
    baseline: Baseline, state: Kinks, stream: int, sign: float, rise: float, hazard: float
) -> Posterior:
    """Posterior of the course of one stream.

    Args:
        sign: +1 where the fault raises the parameter, -1 where it lowers it.
        rise: [spread] up to the critical level, above 0; sets the scale of the prior of paces.
        hazard: prior probability of an onset, and of a stop, per step.
    """
    if not state.N[stream] > 0.0:
        raise InputError("a forecast needs at least one measured step after the baseline")
    seen = stream_of(baseline, state, stream)
    one, smooth, evenly = _even(seen, sign, rise, hazard)
    walks, pace, unevenly, otherwise = _uneven(seen, sign, rise)
    evidence = np.concatenate([evenly, unevenly])
    evidence += np.log(hazard)
    total = float(np.logaddexp.reduce(evidence))
    # A walk has no preferred side: one to the other side is no such fault, yet explains as much.
    other = float(np.logaddexp.reduce(otherwise)) + np.log(hazard)
    healthy = np.logaddexp(np.log1p(-hazard) * state.t, other)
    begun = float(np.exp(total - np.logaddexp(total, healthy)))
    weight = np.exp(evidence - total)
    weight = np.where(weight > NEGLIGIBLE, weight, 0.0)
    even, uneven = np.split(weight / weight.sum(), [len(one.power)])
    return Posterior(_ahead(even, one, smooth), _walking(uneven, walks, pace, sign), begun)


def _even(stream: Stream, sign: float, rise: float, hazard: float) -> tuple[Courses, Paces, Array]:
    """Courses without wander that the data inform; their paces and log evidence."""
    kinds = bent(stream), going(stream), stopped(stream, hazard), always(stream)
    one = Courses(*map(np.concatenate, zip(*kinds, strict=True)))
    S1, S2 = levelled(stream, one)
    informed = (S2 > 0.0) & (one.prior > 0.0)
    one = Courses(*(x[informed] for x in one))
    paces, likely = _paces(sign * S1[informed], S2[informed], one.power, rise)
    return one, paces, likely + np.log(one.prior)


def _uneven(stream: Stream, sign: float, rise: float) -> tuple[Walking, Paces, Array, Array]:
    """Ramps that wander; their paces, and log evidence on the fault's side and on the other."""
    walks, besides = wandering(stream)
    paces, likely = _paces(sign * walks.S1, walks.S2, np.ones(len(walks.S1)), rise)
    likely, high = likely + besides, _height(walks, paces, sign)
    return walks, paces, likely + log_ndtr(high), likely + log_ndtr(-high)


def _paces(S1: Array, S2: Array, power: Array, rise: float) -> tuple[Paces, Array]:
    """Paces of regressions, and the evidence of each."""
    paces = Paces(S1 / S2, 1.0 / np.sqrt(S2))
    likely = 0.5 * (S1 * paces.mean + np.log(2.0 * np.pi / S2)) + paces.cut
    return paces, likely + _density(np.maximum(paces.mean, paces.sd), power, rise)


def levelled(stream: Stream, one: Courses) -> tuple[Array, Array]:
    """S1 and S2 at the actual spread of innovations, less what the level's error explains.

    The variance of the baseline's level b is kappa² / steps of theirs, whatever the course; S2 is 0
    where nothing is left.
    """
    wide = stream.wide
    S1, S2, H = one.S1 / wide, one.S2 / wide, one.H / wide
    precision = stream.precision / wide
    left = S2 - H**2 / precision
    return S1 - H * stream.E / wide / precision, np.where(left > 1e-9 * S2, left, 0.0)


def bent(stream: Stream) -> Courses:
    """Courses that go on, of every power but a ramp's, from every onset kept."""
    others = np.arange(len(POWERS)) != RAMP
    shape = (int(others.sum()), len(stream.onset))
    age = np.broadcast_to(stream.t - stream.onset, shape)
    power = np.broadcast_to(np.array(POWERS)[others, None], shape)
    sums = stream.S[:, others]
    prior = np.array(SHARES)[others, None] * stream.mass
    lasts = np.full(shape, np.inf)
    return Courses(*(x.ravel() for x in (*sums, age**power, age, lasts, power, prior)))


def going(stream: Stream) -> Courses:
    """Ramps that go on, from onsets between kept neighbours i and j.

    Their h is w h_i + (1 - w) h_j, except in the few steps between the two. Old neighbours are far
    apart, whereas the onset of long growth is known sharply.
    """
    onset, (S1, S2, H) = stream.onset, stream.S[:, RAMP]
    i = np.arange(len(onset))
    j = np.minimum(i + 1, i[-1])
    apart = onset[j] - onset[i] >= max(len(stream.a), 1)
    w = np.where(apart, PARTS[:, None], np.round(PARTS)[:, None])  # nearer ones: either of the two
    both = _products(stream, i, j)
    S2 = w**2 * S2[i] + 2.0 * w * (1.0 - w) * both + (1.0 - w) ** 2 * S2[j]
    S1, H, age = (w * x[i] + (1.0 - w) * x[j] for x in (S1, H, stream.t - onset))
    one = np.ones(w.shape)
    prior = one * np.diff(onset, append=stream.t) * SHARES[RAMP] / len(PARTS)
    return Courses(*(x.ravel() for x in (S1, S2, H, age, age, np.inf * one, one, prior)))


def stopped(stream: Stream, hazard: float) -> Courses:
    """Ramps from an onset i that stopped at a later one j: h_i - h_j."""
    onset, (S1, S2, H) = stream.onset, stream.S[:, RAMP]
    between = onset - onset[:, None]
    i, j = np.nonzero(between >= max(len(stream.a), 1))
    lasts = between[i, j]
    both = _products(stream, i, j)
    prior = hazard * SHARES[RAMP] * stream.mass[i] * stream.mass[j]
    power, age = np.ones(len(i)), stream.t - onset[i]
    return Courses(
        S1[i] - S1[j], S2[i] - 2.0 * both + S2[j], H[i] - H[j], lasts, age, lasts, power, prior
    )


def _products(stream: Stream, i: Index, j: Index) -> Array:
    """Sum h_i h_j of ramps from an onset i and a later one j.

    Where j is at least as many steps after i as the autoregression has lags, h_i is a straight line
    by then, (1 - sum a) k + sum j a_j, whose sums are kept. This fails after a gap, where the
    products themselves are kept.
    """
    passed, lag = stream.passed, stream.a @ np.arange(1.0, len(stream.a) + 1.0)
    timed, plain = stream.K[:, j]
    both = passed * timed + (passed * (stream.onset[j] - stream.onset[i]) + lag) * plain
    return np.asarray(both + stream.P[i, j] if stream.P.size else both)


def always(stream: Stream) -> Courses:
    """Exponentials, which have no onset: each was as large as the noise at some step.

    Only those count whose history spans more than two e-folds.
    """
    one, (S1, S2, H) = np.ones(len(TIMES)), stream.X
    prior = ALWAYS / len(TIMES) * np.where(stream.t > 2.0 * TIMES, TIMES, 0.0)
    return Courses(S1, S2, H, one, ENDLESS * TIMES, np.inf * one, ENDLESS * one, prior)


def _density(pace: Array, power: Array, rise: float) -> Array:
    """Log prior density of paces: the critical level is D > 2 steps from the onset, p(D) = 2 / D².

    This is flat in the rate of a ramp. Steps are uniform up to the level; exponentials were as
    large as the noise at any step with equal probability, and have grown since.
    """
    g = np.where((power > 0.0) & (power < ENDLESS), power, 1.0)
    known = np.log(2.0 / (g * rise)) + (1.0 - 1.0 / g) * np.log(rise / pace)
    faster = -np.log(np.maximum(pace, 1.0))
    return np.select([power == 0.0, power < ENDLESS], [-np.log(rise), known], faster)


def _ahead(weight: Array, one: Courses, pace: Paces) -> Smooth:
    """Courses that count; an accelerating one has three equally likely futures."""
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
        weight=weight[each],
        age=age[each],
        lasts=lasts[each],
        power=power[each],
        haste=haste[each] * hurried,
        ahead=ahead,
        mean=(now * pace.mean[kept])[each],
        sd=(now * pace.sd[kept])[each],
    )


class Walking(NamedTuple):
    """Regressions on ramps that wander, (C,) each."""

    S1: Array
    S2: Array
    age: Array  # [steps]
    shape: Array  # [steps] present level per unit of pace
    off: Array  # [spread] present level without the ramp
    var: Array  # [spread²]
    walk: Array  # [spread²/step]


def wandering(stream: Stream) -> tuple[Walking, Array]:
    """Ramps that wander, and the log odds of each beyond its regression's, prior included.

    u is `passed` times the level.
    """
    x, wide, passed = stream.walks, stream.wide, stream.passed
    age = np.broadcast_to(stream.t - stream.onset, x.mean.shape)
    misfit = x.misfit + stream.E**2 / stream.precision
    odds = np.log(UNEVEN * SHARES[RAMP] / len(STEPS) * stream.mass)
    odds = odds - 0.5 * (misfit / wide + x.width - np.log(stream.precision))
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
    """The wandering ramps that count."""
    kept = weight > 0.0
    return Wandering(
        weight=weight[kept],
        age=one.age[kept],
        mean=pace.mean[kept],
        sd=pace.sd[kept],
        shape=one.shape[kept],
        off=sign * one.off[kept],
        var=one.var[kept],
        walk=one.walk[kept],
    )
