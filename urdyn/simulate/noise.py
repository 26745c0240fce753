"""What sensors do to a signal: coloured noise, quantisation, and failures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from urdyn.simulate.schedule import Course
from urdyn.types import Array, freeze

STANDING = 1e-6  # [rad/s] below which a joint reports exactly 0


@dataclass(frozen=True, eq=False)
class Band:
    """A component of a noise that decays, or rings down; the rest is white.

        correlation at a lag t = share exp(-t / time) cos(2 pi frequency t)

    Defined in continuous time, so that the noise is the same at any rate of the log.
    """

    time: float  # [s]
    share: Array  # (J,) [-] of the variance
    frequency: float = 0.0  # [Hz]

    def __post_init__(self) -> None:
        freeze(self, "share")

    def correlation(self, lag: Array) -> Array:
        """Its part of the noise's correlation at lags (K,) [s], (K, J) [-]."""
        decayed = np.exp(-lag / self.time) * np.cos(2.0 * np.pi * self.frequency * lag)
        return np.outer(decayed, self.share)


def quantised(values: Array, step: float) -> Array:
    """Values quantised with this step; 0: not quantised."""
    return np.round(values / step) * step if step else values


def jittered(v: Array, sd: float, rng: np.random.Generator) -> Array:
    """Velocities with white noise where a joint moves; real controllers report 0 at rest."""
    if not sd:
        return v
    noisy = rng.standard_normal(v.shape)  # only one array of this size, as it may be an hour's
    noisy *= sd
    noisy += v
    noisy[np.abs(v) <= STANDING] = 0.0
    return noisy


def coloured(rng: np.random.Generator, rows: int, sd: Array, colour: float) -> Array:
    """Stationary AR(1) noise of standard deviation `sd`, (rows, J):

    e_t = c e_{t-1} + sqrt(1 - c²) sd w_t
    """
    white = rng.standard_normal((rows, len(sd)))
    white[1:] *= np.sqrt(1.0 - colour**2)  # the first row is from the stationary distribution
    white *= sd
    return np.asarray(lfilter([1.0], [1.0, -colour], white, axis=0)) if colour else white


def banded(
    rng: np.random.Generator, rows: int, sd: Array, bands: tuple[Band, ...], step: float
) -> Array:
    """White noise plus that of each band, with total standard deviation `sd`, (rows, J).

    Args:
        step: time between rows [s].
    """
    left = 1.0 - sum((band.share for band in bands), np.zeros(len(sd)))
    noise = coloured(rng, rows, sd * np.sqrt(np.maximum(left, 0.0)), 0.0)
    for band in bands:
        scale, keep = sd * np.sqrt(band.share), float(np.exp(-step / band.time))
        if band.frequency:
            turn = np.exp(2j * np.pi * band.frequency * step)
            noise += swinging(rng, rows, scale, keep * turn)
        else:
            noise += coloured(rng, rows, scale, keep)
    return noise


def swinging(rng: np.random.Generator, rows: int, sd: Array, pole: complex) -> Array:
    """The same with a complex pole: real part of

    z_t = pole z_{t-1} + sqrt(1 - |pole|²) sd w_t
    """
    white = rng.standard_normal((rows, len(sd))) + 1j * rng.standard_normal((rows, len(sd)))
    white[1:] *= np.sqrt(1.0 - abs(pole) ** 2)
    return np.asarray(lfilter([1.0], [1.0, -pole], white * sd, axis=0).real)


def told(current: Array, course: Course, before: Array, rng: np.random.Generator) -> Array:
    """A current (N, J) [A] as faulty sensors report it; `before`: their last report, (J,)."""
    reported = current
    if course.sensor_bias.any():
        reported = reported + course.sensor_bias
    if course.sensor_noise.any():
        reported = reported + course.sensor_noise * rng.standard_normal(current.shape)
    if course.sensor_stuck.any():
        fresh = np.where(course.sensor_stuck, 0, np.arange(1, len(current) + 1)[:, None])
        last = np.maximum.accumulate(fresh, axis=0)
        reported = np.take_along_axis(np.vstack([before, reported]), last, axis=0)
    if course.sensor_dropped.any():
        reported = np.where(course.sensor_dropped, np.nan, reported)
    return reported
