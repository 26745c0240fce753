"""Which poses are gross errors: a mixture of what noise does and of what is simply wrong.

A pose that was measured, or written down, wrongly is off by many times the noise in any direction.
Its weight is the probability that it is none of these [Aitkin1980]_, so that clean data are treated
as they are.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Mask

RARE = 0.02  # share of poses that are expected to be wrong
WIDE = 20.0  # gross errors have so many times the noise
BEYOND = 10.0  # times the noise: such a pose is no pose of this arm
MEDIAN_OF_THREE = 1.5382  # of the length of three unit normal numbers


def robust_noise(e: Array) -> Array:
    """Noise of place [m] and turn [rad] by the median of residuals e (N, 6), (2,)."""
    lengths = np.stack([np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)])
    known = np.isfinite(lengths).all(axis=1)
    noise = np.ones(2)
    noise[known] = np.median(lengths[known], axis=1) / MEDIAN_OF_THREE
    return np.maximum(noise, 1e-9)


def weights(e: Array, noise: Array) -> Array:
    """(N,) probability of each pose of residuals e (N, 6) to be no gross error."""
    likely = 0.5 * _worst(e, noise) * (1.0 - WIDE**-2.0)
    odds = np.log(RARE / (1.0 - RARE)) - 3.0 * np.log(WIDE) + likely
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(odds, 500.0))))


def moderate(e: Array, noise: Array) -> Mask:
    """(N,) poses whose residuals e (N, 6) are errors of an arm, not of a person."""
    return np.asarray(_worst(e, noise) < BEYOND**2)


def _worst(e: Array, noise: Array) -> Array:
    """(N,) square of the length of place or turn, whichever is longer, in units of noise."""
    worst = np.zeros(len(e))
    for k, block in enumerate((slice(0, 3), slice(3, 6))):
        if np.isfinite(e[:, block]).any():
            worst = np.fmax(worst, (e[:, block] ** 2).sum(axis=1) / noise[k] ** 2)
    return worst
