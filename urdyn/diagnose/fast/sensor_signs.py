"""Signs of sensor faults in rows of currents: runs, outliers, noise."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from urdyn.types import MAD_TO_SD, Array, Index, Mask

ENOUGH = 24  # rows needed to estimate noise
# Times the noise by which a single value differs from two on each side, and most by which these
# differ from each other. A shift that all share, as of another load, does not count.
APART, USUAL = 10.0, 4.0
APARTS = (1, 2, 3)  # rows; in one of them no tone is louder than 1.2 times its sd
SECOND = np.sqrt(6.0)  # sd of second differences of white noise, over its own


def noisier(ratio: Array) -> Array:
    """How much noisier each joint is than any other: an arm that shakes is no sensor fault."""
    ratio = np.nan_to_num(ratio)
    order = np.argsort(ratio)
    others = np.full_like(ratio, ratio[order[-1]])
    others[order[-1]] = ratio[order[-2]] if len(order) > 1 else 0.0
    return np.asarray(ratio / np.maximum(others, 1.0))


def lapses(last: Array, current: Array) -> Mask:
    """Where one joint alone has no value, (N, J), after a row in which it had.

    Args:
        last: values of the row before, (J,) [A].
    """
    missing = np.isnan(np.vstack([last, current]))
    return np.asarray(missing[1:] & ~missing[:-1] & single(missing[1:]))


def off(left: Array) -> Mask:
    """Values far from their neighbours, which are alike, (N, J); of (N, J) in units of noise.

    None next to unknown values, where the outlier is ambiguous. The first two and the last two are
    compared with the nearest four.
    """
    n, row = len(left), np.arange(len(left))[:, None]
    if n < 5:
        return np.zeros(left.shape, dtype=bool)
    five = np.clip(row - 2, 0, n - 5) + np.arange(5)
    around = left[five[five != row].reshape(n, 4)]
    lo, hi = around.min(axis=1), around.max(axis=1)
    return np.asarray((np.abs(left - 0.5 * (lo + hi)) > APART) & (hi - lo < USUAL))


def paired(sign: Mask) -> Mask:
    """Where a sign is also in the row before or after, (N, J)."""
    before, after = np.pad(sign, ((1, 0), (0, 0)))[:-1], np.pad(sign, ((0, 1), (0, 0)))[1:]
    return np.asarray(sign & (before | after))


def single(torn: Mask) -> Mask:
    """Rows in which exactly one joint's value is invalid, (N, 1)."""
    return np.asarray(np.count_nonzero(torn, axis=1, keepdims=True) == 1)


def rough(before: Array, residual: Array) -> Array:
    """Noise between neighbours [A], insensitive to motion, single jumps and tones.

    Second differences of adjacent rows make a tone that alternates between them up to twice as
    loud; in those of rows further apart it nearly vanishes.
    """
    least = np.full(residual.shape[1], np.nan)
    for apart in APARTS:
        bent = np.abs(residual[2 * apart :] - 2.0 * residual[apart:-apart] + residual[: -2 * apart])
        known = np.isfinite(bent).sum(axis=0) >= ENOUGH // 2
        if known.any():
            least[known] = np.fmin(least[known], _median(bent[:, known]))
    return np.where(np.isnan(least), before, MAD_TO_SD * least / SECOND)


def _median(rows: Array) -> Array:
    """Median of the known values of each joint, (J,), of (N, J): `nanmedian`, but quickly."""
    ordered, known = np.sort(rows, axis=0), np.count_nonzero(~np.isnan(rows), axis=0)  # NaN last
    middle = np.stack([known - 1, known]) // 2
    return np.asarray(np.take_along_axis(ordered, middle, axis=0).mean(axis=0))


def usually(covariance: Array, dof: Array) -> Array:
    """The usual value of `rough` for noise, (J,) [A].

    A sum of three t innovations keeps half of their excess kurtosis.

    Args:
        covariance: of the noise, 0 .. rows apart, (rows + 1, J) [A²].
        dof: of its innovations, (J,).
    """
    bent = [6.0 * covariance[0] - 8.0 * covariance[k] + 2.0 * covariance[2 * k] for k in APARTS]
    of = 2.0 * dof - 4.0
    tails = MAD_TO_SD * stdtrit(of, 0.75) * np.sqrt((of - 2.0) / of)
    return np.asarray(tails * np.sqrt(np.min(bent, axis=0)) / SECOND)


def runs(sign: Mask, t: Array, before: Array, began: Array) -> tuple[Array, Array]:
    """At each row, rows for which a sign has lasted, and when that began, (N, J) each."""
    at = np.arange(1, len(t) + 1)[:, None]
    broken = np.maximum.accumulate(np.where(sign, 0, at), axis=0)
    length = at - broken + np.where(broken == 0, before, 0.0)
    first = np.where(before > 0.0, began, t[0])
    started = np.where(broken == 0, first, t[np.minimum(broken, len(t) - 1)])
    return np.asarray(length), np.asarray(started)


def last_of(values: Array, told: Mask) -> Array:
    """Values (N, J) at the last row of a sign, (J,); arbitrary for joints without one."""
    return np.asarray(values[last_row(told), np.arange(values.shape[1])])


def last_row(told: Mask) -> Index:
    """The last row of a sign, (J,)."""
    return np.asarray(len(told) - 1 - np.argmax(told[::-1], axis=0))


def together(went: Array, missing: Mask, fell: Mask) -> Array:
    """Number of joints that fell silent at the same row as each found silent, (J,); else inf.

    Args:
        went: when each joint's silence began, (N, J) [s].
        missing: where it is silent, (N, J).
        fell: where its silence is found, (N, J).
    """
    alike = missing[:, None, :] & (went[:, None, :] == went[:, :, None])
    return np.asarray(np.where(fell, np.count_nonzero(alike, axis=2), np.inf).min(axis=0))
