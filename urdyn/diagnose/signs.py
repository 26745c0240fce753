"""What single rows of currents show of their sensors: runs of one sign, values far off, noise."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from urdyn.types import MAD_TO_SD, Array, Index, Mask

ENOUGH = 24  # rows at least that tell of noise
# Times the noise that a single value is apart from two to each side, and that these are at most
# from each other. What all of them share, as of another load, is nothing of the value.
APART, USUAL = 10.0, 4.0
APARTS = (1, 2, 3)  # rows; in one of them no tone is louder than 1.2 times its sd
SECOND = np.sqrt(6.0)  # sd of second differences of white noise, over its own


def noisier(ratio: Array) -> Array:
    """How much noisier each joint is than any other: an arm that shakes is no sensor."""
    ratio = np.nan_to_num(ratio)
    order = np.argsort(ratio)
    others = np.full_like(ratio, ratio[order[-1]])
    others[order[-1]] = ratio[order[-2]] if len(order) > 1 else 0.0
    return np.asarray(ratio / np.maximum(others, 1.0))


def lapses(last: Array, current: Array) -> Mask:
    """Where a joint alone begins to tell nothing, (N, J), after a row in which it did.

    Args:
        last: what was told in the row before, (J,) [A].
    """
    missing = np.isnan(np.vstack([last, current]))
    return np.asarray(missing[1:] & ~missing[:-1] & single(missing[1:]))


def off(left: Array) -> Mask:
    """Values far from all beside them, which are about alike, (N, J); of (N, J) [-] of the noise.

    Beside what is not known, none: nobody could tell which of them is off. The first two and the
    last two stand beside the four that are nearest.
    """
    n, row = len(left), np.arange(len(left))[:, None]
    if n < 5:
        return np.zeros(left.shape, dtype=bool)
    five = np.clip(row - 2, 0, n - 5) + np.arange(5)
    around = left[five[five != row].reshape(n, 4)]
    lo, hi = around.min(axis=1), around.max(axis=1)
    return np.asarray((np.abs(left - 0.5 * (lo + hi)) > APART) & (hi - lo < USUAL))


def paired(sign: Mask) -> Mask:
    """Where a sign is in the row before or after, too, (N, J)."""
    before, after = np.pad(sign, ((1, 0), (0, 0)))[:-1], np.pad(sign, ((0, 1), (0, 0)))[1:]
    return np.asarray(sign & (before | after))


def single(torn: Mask) -> Mask:
    """Rows in which one joint's value is none, (N, 1)."""
    return np.asarray(np.count_nonzero(torn, axis=1, keepdims=True) == 1)


def rough(before: Array, residual: Array) -> Array:
    """Noise between neighbours [A], from which no motion, no single jump and no tone is seen.

    Second differences of rows next to each other make a tone that turns over between them as much
    as twice as loud; in those of rows further apart it is as good as gone.
    """
    least = np.full(residual.shape[1], np.nan)
    for apart in APARTS:
        bent = np.abs(residual[2 * apart :] - 2.0 * residual[apart:-apart] + residual[: -2 * apart])
        known = np.isfinite(bent).sum(axis=0) >= ENOUGH // 2
        if known.any():
            least[known] = np.fmin(least[known], np.nanmedian(bent[:, known], axis=0))
    return np.where(np.isnan(least), before, MAD_TO_SD * least / SECOND)


def usually(covariance: Array, dof: Array) -> Array:
    """What `rough` is of noise as a rule, (J,) [A].

    Of three t innovations that add up half of the excess of kurtosis is left.

    Args:
        covariance: with itself 0 .. rows later, (rows + 1, J) [A²].
        dof: of its innovations, (J,).
    """
    bent = [6.0 * covariance[0] - 8.0 * covariance[k] + 2.0 * covariance[2 * k] for k in APARTS]
    of = 2.0 * dof - 4.0
    tails = MAD_TO_SD * stdtrit(of, 0.75) * np.sqrt((of - 2.0) / of)
    return np.asarray(tails * np.sqrt(np.min(bent, axis=0)) / SECOND)


def runs(sign: Mask, t: Array, before: Array, began: Array) -> tuple[Array, Array]:
    """Rows for which a sign has lasted by each, and when that began, (N, J) each."""
    at = np.arange(1, len(t) + 1)[:, None]
    broken = np.maximum.accumulate(np.where(sign, 0, at), axis=0)
    length = at - broken + np.where(broken == 0, before, 0.0)
    first = np.where(before > 0.0, began, t[0])
    started = np.where(broken == 0, first, t[np.minimum(broken, len(t) - 1)])
    return np.asarray(length), np.asarray(started)


def last_of(values: Array, told: Mask) -> Array:
    """What rows say, (N, J), where a sign was told last, (J,); of joints where it was not, any."""
    return np.asarray(values[last_row(told), np.arange(values.shape[1])])


def last_row(told: Mask) -> Index:
    """The last row in which it was, (J,)."""
    return np.asarray(len(told) - 1 - np.argmax(told[::-1], axis=0))


def together(went: Array, missing: Mask, fell: Mask) -> Array:
    """Joints that fell silent at the same row as each that is found silent, (J,); inf: is none.

    Args:
        went: when each joint's silence began, (N, J) [s].
        missing: where it is silent, (N, J).
        fell: where that is found, (N, J).
    """
    alike = missing[:, None, :] & (went[:, None, :] == went[:, :, None])
    return np.asarray(np.where(fell, np.count_nonzero(alike, axis=2), np.inf).min(axis=0))
