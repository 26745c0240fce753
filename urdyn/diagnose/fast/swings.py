"""Swings in a stretch of rows: how large, at which frequency, and how far a line stands out."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from urdyn.types import Array, frozen

TREND = 6.0  # windows over which a swing's growth is estimated
SCATTER = 0.05  # [-] of its amplitude by which a swing varies apart from noise
NEIGHBOURS = 6  # bins to each side that make a line's neighbourhood


def bridged(x: Array) -> Array:
    """Signals (..., n, J) with single missing rows filled halfway between their neighbours."""
    mended = x.copy()
    inner, between = mended[..., 1:-1, :], 0.5 * (x[..., :-2, :] + x[..., 2:, :])
    inner[...] = np.where(np.isnan(inner), between, inner)
    return mended


def amplitude(x: Array, t: Array, frequency: float) -> float:
    """Amplitude of a swing of this frequency, apart from a slow motion."""
    w = 2.0 * np.pi * frequency * (t - t[0])
    found = _beside_motion(np.column_stack([np.cos(w), np.sin(w)]), x, t)
    return float(np.hypot(found[0], found[1]))


def course(x: Array, t: Array, frequency: float) -> Array:
    """Amplitudes of a swing of this frequency by quarter, apart from a slow motion, (4,)."""
    found = _beside_motion(by_quarter(t, frequency), x, t)
    return np.asarray(np.hypot(found[0:8:2], found[1:8:2]))


def without(x: Array, t: Array, swings: Array) -> Array:
    """Signals (n, ...) without what swings (n, k) explain apart from a slow motion."""
    return np.asarray(x - swings @ _beside_motion(swings, x, t))


def by_quarter(t: Array, frequency: float) -> Array:
    """Swings of this frequency in each quarter of the time, (n, 8)."""
    w = 2.0 * np.pi * frequency * (t - t[0])
    swings = np.zeros((len(t), 8))
    for k, part in enumerate(parts(len(t), 4)):
        swings[part, 2 * k] = np.cos(w[part])
        swings[part, 2 * k + 1] = np.sin(w[part])
    return swings


Course = tuple[tuple[float, float, float], ...]  # [s] end of a stretch, amplitude, [s] its length


def going_on(before: Course, t: Array, sizes: Array) -> Course:
    """The course of a swing with a window's new part, and without what is too old.

    Only the window's second half counts: the swing may have begun in the first.

    Args:
        sizes: by quarter of the window, (4,).
    """
    begin, end = float(t[0]), float(t[-1])
    long = 0.25 * (end - begin)
    last = before[-1][0] if before else begin
    ends = ((end - long, float(sizes[2])), (end, float(sizes[3])))
    new = ((at, size, long) for at, size in ends if at - long >= last)
    return tuple(one for one in (*before, *new) if one[0] > end - 4.0 * TREND * long)


def growth(course: Course, noise: float) -> tuple[float, float, float]:
    """Amplitude at a course's end, and how fast its logarithm grows, with sd [1/s].

    Args:
        noise: sd of an amplitude measured over a second.
    """
    ends, sizes, long = np.array(course).T
    t = ends - 0.5 * long
    w = 1.0 / np.hypot(SCATTER, noise / (np.sqrt(long) * sizes))
    line, cov = np.polyfit(t - ends[-1], np.log(sizes), 1, w=w, cov="unscaled")
    left = w * (np.log(sizes) - np.polyval(line, t - ends[-1]))
    louder = max(1.0, float(left @ left) / max(len(t) - 2, 1))
    return float(np.exp(line[1])), float(line[0]), float(np.sqrt(cov[0, 0] * louder))


def _beside_motion(swings: Array, x: Array, t: Array) -> Array:
    """Least squares of x (n, ...) by swings (n, k) and a slow motion: of swings, (k, ...)."""
    Q, k = _slow(len(t), max(1, round(float(t[-1] - t[0])))), swings.shape[1]
    both = np.column_stack([swings, x])
    left = both - Q @ (Q.T @ both)
    return np.asarray(np.linalg.lstsq(left[:, :k], left[:, k:])[0]).reshape(k, *x.shape[1:])


@lru_cache(maxsize=16)
def _slow(n: int, seconds: int) -> Array:
    """Basis of slow motions, (n, 5 m), orthonormal: a quartic in each of its m seconds."""
    basis = np.zeros((n, 5 * seconds))
    for k, part in enumerate(parts(n, seconds)):
        u = np.linspace(-1.0, 1.0, part.stop - part.start)
        basis[part, 5 * k : 5 * k + 5] = np.linalg.qr(np.polynomial.polynomial.polyvander(u, 4))[0]
    return frozen(basis)


def refined(x: Array, t: Array, frequency: float, width: float) -> float:
    """Frequency at which the swing is largest, within a bin; to a fortieth of it."""
    for reach, count in ((0.8, 9), (0.15, 7)):
        tried = frequency + reach * width * np.linspace(-1.0, 1.0, count)
        frequency = float(tried[int(np.argmax([amplitude(x, t, f) for f in tried]))])
    return frequency


def parts(n: int, count: int) -> list[slice]:
    """`count` stretches of n rows, as equal as possible."""
    ends = np.linspace(0, n, count + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(ends.tolist())]


def spectrum(x: Array, count: int) -> Array:
    """Power of tapered stretches (..., n, J) at the lowest frequencies, (..., count, J)."""
    n, x = x.shape[-2], np.nan_to_num(x)
    basis = _parabola(n)
    left = x - basis @ (basis.T @ x)
    lines = np.fft.rfft(left * np.hanning(n)[:, None], axis=-2)
    return np.asarray(np.abs(lines[..., :count, :]) ** 2)


@lru_cache(maxsize=16)
def _parabola(n: int) -> Array:
    """Basis of slow trends, (n, 3), orthonormal."""
    u = np.linspace(-1.0, 1.0, n)
    return frozen(np.linalg.qr(np.stack([np.ones(n), u, u**2], axis=1))[0])


def neighbourhood(power: Array) -> Array:
    """Mean of each bin's neighbours, if they are noise, from their median."""
    return np.asarray(_median_beside(power) / np.log(2.0))


def floor(beside: Array, usual: Array) -> Array:
    """The floor for a line: the largest of a bin's neighbourhood and its usual levels.

    A dozen neighbours are few: by chance they are too quiet far more often than a line is loud.

    Args:
        beside: `neighbourhood`.
        usual: usual power, an average that scatters less.
    """
    return np.maximum(np.maximum(beside, usual), _median_beside(usual))


def _median_beside(power: Array) -> Array:
    """Median of each bin's neighbours, without those that its own line leaks into, (..., F, J).

    A spectrum goes on beyond its ends as in a mirror.
    """
    bins, apart = power.shape[-2], np.arange(3, NEIGHBOURS + 3)
    at = np.arange(bins) + np.concatenate([-apart, apart])[:, None]
    at %= max(2 * (bins - 1), 1)
    around = np.sort(power[..., np.minimum(at, 2 * (bins - 1) - at), :], axis=-3)
    return np.asarray(around[..., NEIGHBOURS - 1 : NEIGHBOURS + 1, :, :].mean(axis=-3))


def lines(x: Array, count: int) -> Array:
    """How far each bin of a half stands out, (2, F, J)."""
    power = spectrum(x, count)
    return np.asarray(power / np.maximum(neighbourhood(power), 1e-30))
