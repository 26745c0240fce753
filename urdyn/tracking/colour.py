"""The colour of the currents' noise, learnt while the arm works.

What a model leaves of a current is no white noise: drives filter, gears ripple, and what nobody
modelled passes slowly. With e the residual,

    e = slow + n,    n_t = sum_k ar_k n_{t-k} + w_t,    slow: forgets itself in MEMORY

A filter that took e for white would be sure too soon. It is given the currents and their regressors
after the filter 1 - sum_k ar_k z^-k, whose noise is w, and `slow` as a state.

The residuals that this is learnt from lack what the parameters took for theirs. With H d what these
are wrong by in a current,

    E n_t n_{t-k} = E e_t e_{t-k} - E n_t (H d)_{t-k},    E slow (H d) = (H P)_slow < 0

which is what the filter doubts of both together, as of slow noise and a joint's offset, and is
added again: else noise would seem the less, and the filter be the surer, the more it has learnt.
Of the white innovations' power, what the filter doubts of the current, `slow` itself aside, is
no noise: w would seem too large wherever a model is still learning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from urdyn.identify.noise import Noise
from urdyn.identify.slow import MEMORY
from urdyn.tracking import variance_scale
from urdyn.tracking.variance_scale import VarianceScale
from urdyn.types import Array, Mask, changed

ORDER = 8
FAR = 0.25  # [s] apart: only what is slow is still alike
# [s] A swing of 4 n Hz correlates at the lag FAR as slow noise does; averaged over this range of
# lags around it, it does not.
AROUND = 0.25
SWINGS = 0.25  # [-] of what one time apart tells: where the average is less, it swings
TRUST = 500.0  # samples that the commissioned noise counts for
SLOW_TRUST = 20.0  # [s] that what passed slowly on the first day counts for besides
TOLD = 0.02  # [-] of the variance: a smaller share that was slow on the first day is taken for none
LEARN = 60.0  # [s] over which noise is averaged
CLIP = 3.0  # [sd] beyond which a residual counts as that large: no noise, something happened
KEPT = 0.995  # [-] of Gaussian noise's variance: what is left of it then
PAUSE, PAUSE_TIME = 25.0, 0.25  # samples and, where they are many, [s] between looks at the colour
# [sd] by which residuals that are far apart are alike by chance, if nothing was slow on the first
# day; where something was, it is no news that it is.
CHANCE = 2.5
TINY = 1e-4  # [A] no sensor of a current is better
SLOWEST = 0.01  # [-] of the noise's sd that is slow in any case: no state is known exactly
WHITE = 0.02  # [-] of a residual's variance that is white at least
NOISE = 0.5  # [-] of innovations' power that is noise at least, where they tell of it
LEAST = 0.05  # [-] of it that nothing predicts
APART = np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))  # samples, of these p


@dataclass(frozen=True, eq=False)
class Colour:
    """What is known of the noise, and the samples that it is told from."""

    past: Array  # (p, J, w + 1) packed inputs and current [A], newest first; NaN where none is told
    left: Array  # (L, J) [A] residuals without the model's slow part, newest first
    alike: Array  # (p + 3, J) [A²] mean product of residuals 0 .. p samples, FAR, around FAR apart
    count: Array  # (p + 3, J) samples behind each, those of the first day among them
    known: Mask  # (J,) whether something was slow on the first day
    sample: float  # how many there were, with a current or without
    ar: Array  # (J, p)
    scale: Array  # (J,) [A] sd of w
    slow: Array  # (J,) [A] sd
    taken: Array  # (p + 2, J) [A²] by which `alike` lacks what parameters took, from one sample on
    alone: Array  # (J,) [A²] variance of the slow part, as it is believed
    modelled: Array  # (J,) [A²] mean variance of innovations by doubt about the model
    variance_scale: VarianceScale  # of motions


def first(noise: Noise, width: int, period: float) -> Colour:
    """The commissioned noise, as samples that may be further apart show it.

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
    return Colour(
        past=np.full((ORDER, J, width + 1), np.nan),
        left=np.full((_around(period).stop, J), np.nan),
        alike=np.concatenate([quick, np.zeros((2, J))]) + slow * _passing(period),
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
    """Samples that are FAR apart; where they are few, more, none that the filter knows of."""
    return max(ORDER, round(FAR / period))


@lru_cache(maxsize=8)
def _around(period: float) -> slice:
    """How many samples apart those are of which the average tells whether it swings."""
    far, half = _far(period), round(0.5 * AROUND / period)
    return slice(far - half, far + half + 1)


@lru_cache(maxsize=8)
def _passing(period: float) -> Array:
    """What is left of slow noise 0 .. p samples later and, twice, FAR later, (p + 3, 1)."""
    return np.exp(-np.append(np.arange(ORDER + 1), [_far(period)] * 2) * period / MEMORY)[:, None]


def _neighbours(alike: Array) -> Array:
    """Covariance of the p samples before one, (J, p, p), by autocovariances (p + 1, J)."""
    return np.asarray(alike[APART].transpose(2, 0, 1))


def whitened(colour: Colour, packed: Array, y: Array) -> tuple[Array, Array, Colour]:
    """Inputs and currents after the filter that makes noise white; it has seen them from then on.

    Args:
        packed: what multiplies the parameters, (J, w); 0 after it where there is no current.
        y: currents (J,) [A]; NaN where there is none.
    """
    now = np.concatenate([packed, y[:, None]], axis=1)
    white = now - (colour.ar[:, None] @ colour.past.transpose(1, 0, 2))[:, 0]
    packed, seen = white[:, :-1], white[:, -1]
    known = np.isfinite(seen)
    if np.count_nonzero(known) < len(known):
        packed[~known], now[np.isnan(y)] = 0.0, np.nan
    return packed, seen, changed(colour, past=np.concatenate([now[None], colour.past[:-1]]))


def interrupted(colour: Colour) -> Colour:
    """After a gap nothing stands beside what was before."""
    past, left = (np.full_like(old, np.nan) for old in (colour.past, colour.left))
    return replace(colour, past=past, left=left)


def unlearnt(colour: Colour, before: Colour) -> Colour:
    """Known no better than it was before; what was left since was no noise."""
    nothing = np.full_like(colour.left, np.nan)
    return replace(before, past=colour.past, left=nothing, sample=colour.sample)


def foreseen(colour: Colour, slow: Array) -> Array:
    """What the noise's past says of the residual to come, slow part and all, (J,) [A]."""
    before = colour.left[:ORDER]
    known = np.where(np.isnan(before), 0.0, before)
    return np.asarray(np.vecdot(colour.ar, known.T - slow[:, None]) + slow)


def learnt(colour: Colour, left: Array, unknown: Array, sure: Mask, period: float) -> Colour:
    """The colour after one more residual, (J,) [A], NaN where there is none.

    Args:
        left: what the model leaves without its slow part.
        unknown: variance of that which is no noise, (J,) [A²].
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
    """Of rows (n, J), (J,): of this few columns by a product, for the time that it takes."""
    return np.asarray(np.full(len(rows), 1.0 / len(rows)) @ rows)


def due(colour: Colour, period: float) -> bool:
    """Whether the averages are to be looked at, at this sample."""
    return colour.sample % _pause(period) < 1.0


@lru_cache(maxsize=8)
def _pause(period: float) -> float:
    """Samples between two looks."""
    return max(PAUSE, round(PAUSE_TIME / period))


def giving_back(colour: Colour, taken: Array, alone: Array, period: float) -> Colour:
    """The colour that knows what parameters take of slow noise, (J,) [A²], from here on.

    Args:
        alone: doubt about that noise itself, (J,) [A²], which is no doubt about the model.
    """
    return changed(colour, taken=taken * _passing(period)[1:], alone=alone)


def doubting(colour: Colour, doubted: Array, sure: Mask, period: float) -> Colour:
    """The colour after a look at what an innovation owes to the model.

    Args:
        doubted: variance of the white innovation by doubt about states, (J,) [A²]; NaN where there
            is none.
        sure: as `learnt` has it.
    """
    gain = _pause(period) / np.minimum(colour.count[0], LEARN / period)
    passed = (1.0 - colour.ar.sum(axis=1)) ** 2 * colour.alone
    found = np.where(sure, doubted - passed, colour.modelled)
    return changed(colour, modelled=colour.modelled + gain * (found - colour.modelled))


def _looked_at(colour: Colour, period: float) -> Colour:
    """The filter and the slow noise that the averages tell of."""
    p, power = ORDER, colour.alike[0]
    count, far = np.minimum(colour.count[-1], LEARN / period), _slowly(colour)
    chance = np.where(colour.known, 0.0, CHANCE * power / np.sqrt(count))
    passing = _passing(period)
    told = np.where(far > chance, far / passing[-1], 0.0)
    slow = np.minimum(told, 0.5 * power)
    fast = colour.alike[:-2] - slow * passing[:-2]
    T = _neighbours(fast) + WHITE * power[:, None, None] * np.eye(p)
    ar = _predictor(T, fast[1:].T, WHITE * power)
    left = fast[0] + np.vecdot(ar, (T @ ar[..., None])[..., 0] - 2.0 * fast[1:].T)
    left = np.maximum(left - colour.modelled, NOISE * left)
    scale = np.sqrt(np.maximum(left, LEAST * power))
    return changed(colour, ar=ar, scale=scale, slow=np.fmax(np.sqrt(slow), SLOWEST * scale))


def _inverse(T: Array, least: Array) -> Array:
    """Of autocovariances (J, p, p), no eigenvalue of which is taken for less than `least` (J,)."""
    try:
        np.linalg.cholesky(T - least[:, None, None] * np.eye(ORDER))
    except np.linalg.LinAlgError:  # averages of products need not be those of any noise
        value, vector = np.linalg.eigh(T)
        return np.asarray(
            vector / np.maximum(value, least[:, None])[:, None] @ vector.swapaxes(1, 2)
        )
    return np.asarray(np.linalg.inv(T))  # a third of the time


def _slowly(colour: Colour) -> Array:
    """Product [A²] of residuals that are FAR apart, (J,), without that of what swings."""
    far, around = colour.alike[-2:]
    return np.asarray(np.where(around < SWINGS * far, around, far))


def _predictor(T: Array, r: Array, white: Array) -> Array:
    """Coefficients (J, p) that predict noise of these autocovariances (J, p, p), (J, p) best.

    Of those that sum to 0 or more: noise that seems to be less at low frequencies than white noise
    is, is what the model's own learning took from it, and would make the model too sure of itself.

    Args:
        white: variance that is white at least, (J,).
    """
    inverse = _inverse(T, white)
    ar, more = (inverse @ r[..., None])[..., 0], inverse.sum(axis=2)
    short = np.maximum(-ar.sum(axis=1), 0.0) / more.sum(axis=1)
    return np.asarray(ar + short[:, None] * more)
