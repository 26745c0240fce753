"""The colour of the currents' noise, learnt while the arm works.

A current's residual is not white noise: drives filter, gears ripple, and unmodelled effects vary
slowly. With e the residual,

    e = slow + n,    n_t = sum_k ar_k n_{t-k} + w_t,    slow: forgets itself in MEMORY

A filter that took e for white would be sure too soon. So it is given currents and regressors
whitened by 1 - sum_k ar_k z^-k, whose noise is w, and `slow` as a state.

The residuals that this is learnt from lack what the parameters absorbed of the noise. With H d the
parameters' error in a current,

    E n_t n_{t-k} = E e_t e_{t-k} - E n_t (H d)_{t-k},    E slow (H d) = (H P)_slow < 0

the posterior covariance of the two, as of slow noise and a joint's offset. It is added back: else
noise would seem smaller, and the filter surer, the more it has learnt. The part of the white
innovations' power that is the filter's own doubt about the current, `slow` aside, is not noise: w
would seem too large wherever a model is still learning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from urdyn.identify.noise import Noise
from urdyn.identify.slow import MEMORY
from urdyn.tracking.noise import variance_scale
from urdyn.tracking.noise.lost_currents import bridged
from urdyn.tracking.noise.variance_scale import VarianceScale
from urdyn.types import Array, Mask, changed

ORDER = 8
FAR = 0.25  # [s] lag at which only slow noise still correlates
# [s] A swing of 4 n Hz correlates at the lag FAR as slow noise does; averaged over this range of
# lags around it, it does not.
AROUND = 0.25
SWINGS = 0.25  # [-] of the product at FAR: where the average around it is less, it is a swing
TRUST = 500.0  # samples that the commissioned noise counts as
SLOW_TRUST = 20.0  # [s] that the first day's slow noise counts as, besides
TOLD = 0.02  # [-] of the variance: a smaller share of slow noise on the first day is taken for 0
LEARN = 60.0  # [s] over which noise is averaged
CLIP = 3.0  # [sd] beyond which a residual counts as that large: an event, not noise
KEPT = 0.995  # [-] share of Gaussian noise's variance that clipping leaves
# Samples, and at high rates [s], between looks at the colour. What a change of the arm leaves
# counts as noise at the second look only: until then the change can be found.
PAUSE, PAUSE_TIME = 25.0, 5.0
# [sd] of chance correlation at the lag FAR, below which nothing counts as slow, unless slow noise
# was found on the first day.
CHANCE = 2.5
TINY = 1e-4  # [A] no current sensor is better
SLOWEST = 0.01  # [-] of the noise's sd that is slow at least: no state is known exactly
WHITE = 0.02  # [-] of a residual's variance that is white at least
NOISE = 0.5  # [-] of the innovations' power that is noise at least
LEAST = 0.05  # [-] of a residual's variance that nothing predicts, at least
APART = np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))  # lags [samples] among the p


@dataclass(frozen=True, eq=False)
class Colour:
    """What is known of the noise, and the samples that it is estimated from."""

    past: Array  # (p, J, w + 1) packed inputs and current [A], newest first; NaN: not compared
    doubt: Array  # (J, p, p) [-] covariance of its noise over that of w: of lost currents
    left: Array  # (L, J) [A] residuals without the model's slow part, newest first
    alike: Array  # (p + 3, J) [A²] mean product of residuals 0 .. p samples, FAR, around FAR apart
    settled: Array  # the same at the last look: what the noise is told from at the next
    count: Array  # (p + 3, J) samples behind each, the first day's included
    known: Mask  # (J,) whether something was slow on the first day
    sample: float  # number of samples, with a current or without
    ar: Array  # (J, p)
    scale: Array  # (J,) [A] sd of w
    slow: Array  # (J,) [A] sd
    taken: Array  # (p + 2, J) [A²] what parameters absorbed of `alike`, from lag 1 on
    alone: Array  # (J,) [A²] posterior variance of the slow part
    modelled: Array  # (J,) [A²] mean variance of innovations due to doubt about the model
    variance_scale: VarianceScale  # of uncertain motions


def first(noise: Noise, width: int, period: float) -> Colour:
    """The commissioned noise, at this sampling period, which may be longer.

    Args:
        width: of the packed inputs.
    """
    J = len(noise.sd)
    quick = noise.autocovariance(ORDER, period)
    told = noise.slow**2 > TOLD * noise.sd**2
    slow = np.where(told, noise.slow, 0.0) ** 2
    ar = np.asarray(np.linalg.solve(_neighbours(quick), quick[1:].T[..., None]))[..., 0]
    sd = np.sqrt(np.maximum(quick[0] - np.einsum("jk,kj->j", ar, quick[1:]), TINY**2))
    count = np.full((ORDER + 3, J), TRUST)
    count[-2:] += np.where(told, SLOW_TRUST / period, 0.0)
    alike = np.concatenate([quick, np.zeros((2, J))]) + slow * _passing(period)
    return Colour(
        past=np.full((ORDER, J, width + 1), np.nan),
        doubt=np.zeros((J, ORDER, ORDER)),
        left=np.full((_around(period).stop, J), np.nan),
        alike=alike,
        settled=alike,
        count=count,
        known=told,
        sample=0.0,
        ar=ar,
        scale=sd,
        slow=np.fmax(np.sqrt(slow), SLOWEST * sd),
        taken=np.zeros((ORDER + 2, J)),
        alone=slow,
        modelled=np.zeros(J),
        variance_scale=variance_scale.as_stated(J, period),
    )


def _far(period: float) -> int:
    """The lag FAR in samples; at least ORDER, the filter's longest."""
    return max(ORDER, round(FAR / period))


@lru_cache(maxsize=8)
def _around(period: float) -> slice:
    """Lags, in samples, over which the average shows whether a correlation is a swing."""
    far, half = _far(period), round(0.5 * AROUND / period)
    return slice(far - half, far + half + 1)


@lru_cache(maxsize=8)
def _passing(period: float) -> Array:
    """Autocorrelation of slow noise at lags 0 .. p and, twice, FAR, (p + 3, 1)."""
    return np.exp(-np.append(np.arange(ORDER + 1), [_far(period)] * 2) * period / MEMORY)[:, None]


def _neighbours(alike: Array) -> Array:
    """Covariance of p consecutive samples, (J, p, p), from autocovariances (p + 1, J)."""
    return np.asarray(alike[APART].transpose(2, 0, 1))


def whitened(
    colour: Colour, packed: Array, y: Array, lost: Mask
) -> tuple[Array, Array, Array, Colour]:
    """Whitened inputs and currents, the sd of their noise [A], and the colour that has seen them.

    Args:
        packed: what multiplies the parameters, (J, w); whitened to 0 where there is no current.
        y: currents (J,) [A]; NaN where there is none.
        lost: whether that is for a loss only, (J,).
    """
    if np.count_nonzero(lost):
        colour = _expecting(colour, lost)
    now = np.concatenate([packed, y[:, None]], axis=1)
    foreseen = (colour.ar[:, None] @ colour.past.transpose(1, 0, 2))[:, 0]
    white = now - foreseen
    packed, seen = white[:, :-1], white[:, -1]
    known = np.isfinite(seen)
    if np.count_nonzero(known) < len(known):
        packed[~known], now[np.isnan(y)] = 0.0, np.nan
    if not np.count_nonzero(lost) and not np.count_nonzero(colour.doubt):
        past = np.concatenate([now[None], colour.past[:-1]])
        return packed, seen, colour.scale, changed(colour, past=past)
    past, doubt, v = bridged(colour.past, colour.doubt, colour.ar, now, foreseen, lost)
    return packed, seen, np.sqrt(v) * colour.scale, changed(colour, past=past, doubt=doubt)


def _expecting(colour: Colour, joints: Mask) -> Colour:
    """The colour with joints' uncompared rows as noise that may be anything, so no NaN spreads."""
    unknown = joints & np.isnan(colour.past[..., -1])
    var = colour.alike[0] / colour.scale**2 * unknown
    past = np.where(unknown[..., None], 0.0, colour.past)
    return changed(colour, past=past, doubt=colour.doubt + var.T[:, :, None] * np.eye(ORDER))


def interrupted(colour: Colour) -> Colour:
    """The colour after a gap: later samples are not compared with those before it."""
    past, left = (np.full_like(old, np.nan) for old in (colour.past, colour.left))
    return replace(colour, past=past, doubt=np.zeros_like(colour.doubt), left=left)


def unlearnt(colour: Colour, before: Colour) -> Colour:
    """The colour as known `before`; residuals since then were not noise."""
    nothing = np.full_like(colour.left, np.nan)
    past, doubt = colour.past, colour.doubt
    return replace(before, past=past, doubt=doubt, left=nothing, sample=colour.sample)


def foreseen(colour: Colour, slow: Array) -> Array:
    """Prediction of the next residual from past noise, slow part included, (J,) [A]."""
    before = colour.left[:ORDER]
    known = np.where(np.isnan(before), 0.0, before)
    return np.asarray(np.vecdot(colour.ar, known.T - slow[:, None]) + slow)


def learnt(colour: Colour, left: Array, unknown: Array, sure: Mask, period: float) -> Colour:
    """The colour after one more residual, (J,) [A], NaN where there is none.

    Args:
        left: what the model leaves without its slow part.
        unknown: variance of the part that is not noise, (J,) [A²].
        sure: whether the model is surer of the current than the sensor, (J,).
    """
    limit = CLIP * np.sqrt(colour.alike[0])
    held = np.minimum(np.maximum(left, -limit), limit)
    left = np.concatenate([held[None], colour.left[:-1]])
    far, near = _far(period), _around(period)
    earlier = np.concatenate([left[: ORDER + 1], left[far : far + 1], _mean(left[near])[None]])
    product = held / KEPT * earlier
    product[0] -= unknown
    product[1:] += colour.taken
    used = sure & np.isfinite(product)
    count = colour.count + used
    step = (product - colour.alike) / np.minimum(count, LEARN / period)
    alike = colour.alike + np.where(used, step, 0.0)
    np.maximum(alike[0], TINY**2, out=alike[0])
    colour = changed(colour, left=left, alike=alike, count=count, sample=colour.sample + 1.0)
    return _looked_at(colour, period) if due(colour, period) else colour


def _mean(rows: Array) -> Array:
    """Mean of rows (n, J), (J,): for this few columns a product is faster."""
    return np.asarray(np.full(len(rows), 1.0 / len(rows)) @ rows)


def due(colour: Colour, period: float) -> bool:
    """Whether the averages are evaluated at this sample."""
    return colour.sample % _pause(period) < 1.0


@lru_cache(maxsize=8)
def _pause(period: float) -> float:
    """Samples between two looks."""
    return max(PAUSE, round(PAUSE_TIME / period))


def giving_back(colour: Colour, taken: Array, alone: Array, period: float) -> Colour:
    """The colour once it knows how much slow noise the parameters absorbed, (J,) [A²].

    Args:
        alone: variance of that noise itself, (J,) [A²], which is not doubt about the model.
    """
    return changed(colour, taken=taken * _passing(period)[1:], alone=alone)


def doubting(colour: Colour, doubted: Array, sure: Mask, period: float) -> Colour:
    """The colour after evaluating how much of an innovation is doubt about the model.

    Args:
        doubted: variance of the white innovation due to doubt about states, (J,) [A²]; NaN: none.
        sure: as in `learnt`.
    """
    gain = _pause(period) / np.minimum(colour.count[0], LEARN / period)
    passed = (1.0 - colour.ar.sum(axis=1)) ** 2 * colour.alone
    found = np.where(sure, doubted - passed, colour.modelled)
    return changed(colour, modelled=colour.modelled + gain * (found - colour.modelled))


def _looked_at(colour: Colour, period: float) -> Colour:
    """The colour with whitening filter and slow noise re-estimated from the averages."""
    p, alike = ORDER, colour.settled
    power = alike[0]
    count, far = np.minimum(colour.count[-1], LEARN / period), _slowly(colour)
    chance = np.where(colour.known, 0.0, CHANCE * power / np.sqrt(count))
    passing = _passing(period)
    told = np.where(far > chance, far / passing[-1], 0.0)
    slow = np.minimum(told, 0.5 * power)
    fast = alike[:-2] - slow * passing[:-2]
    T = _neighbours(fast) + WHITE * power[:, None, None] * np.eye(p)
    ar = _predictor(T, fast[1:].T, WHITE * power)
    left = fast[0] + np.vecdot(ar, (T @ ar[..., None])[..., 0] - 2.0 * fast[1:].T)
    left = np.maximum(left - colour.modelled, NOISE * left)
    scale = np.sqrt(np.maximum(left, LEAST * power))
    slow = np.fmax(np.sqrt(slow), SLOWEST * scale)
    return changed(colour, ar=ar, scale=scale, slow=slow, settled=colour.alike)


def _inverse(T: Array, least: Array) -> Array:
    """Inverse of autocovariances (J, p, p), whose eigenvalues are at least `least` (J,)."""
    try:
        np.linalg.cholesky(T - least[:, None, None] * np.eye(ORDER))
    except np.linalg.LinAlgError:  # averaged products need not form a covariance
        value, vector = np.linalg.eigh(T)
        return np.asarray(
            vector / np.maximum(value, least[:, None])[:, None] @ vector.swapaxes(1, 2)
        )
    return np.asarray(np.linalg.inv(T))  # takes a third of the time


def _slowly(colour: Colour) -> Array:
    """Mean product [A²] of residuals FAR apart, (J,), without that of swings."""
    far, around = colour.settled[-2:]
    return np.asarray(np.where(around < SWINGS * far, around, far))


def _predictor(T: Array, r: Array, white: Array) -> Array:
    """Best linear predictor, (J, p), of noise with these autocovariances (J, p, p), (J, p).

    Its coefficients sum to 0 or more: noise that seems weaker than white noise at low frequencies
    was absorbed by the model's own learning, and would make the model too sure of itself.

    Args:
        white: variance that is white at least, (J,).
    """
    inverse = _inverse(T, white)
    ar, more = (inverse @ r[..., None])[..., 0], inverse.sum(axis=2)
    short = np.maximum(-ar.sum(axis=1), 0.0) / more.sum(axis=1)
    return np.asarray(ar + short[:, None] * more)
