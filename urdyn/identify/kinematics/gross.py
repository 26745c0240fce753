"""Which poses are gross errors: a mixture of noise and of plain mistakes.

A pose that was measured or recorded wrongly is off by many times the noise in any direction. A
pose's weight is the probability that it is not one of these [Aitkin1980]_, so that clean data
keep their full weight.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Mask

RARE = 0.02  # expected share of wrong poses
WIDE = 20.0  # sd of gross errors, in units of the noise
BEYOND = 10.0  # times the noise: farther off, a pose is not this arm's
MEDIAN_OF_THREE = 1.5382  # of the norm of three unit normal numbers


def robust_noise(e: Array) -> Array:
    """Noise of place [m] and turn [rad] from medians of residuals e (N, 6), (2,)."""
    lengths = np.stack([np.linalg.norm(e[:, :3], axis=1), np.linalg.norm(e[:, 3:], axis=1)])
    known = np.isfinite(lengths).all(axis=1)
    noise = np.ones(2)
    noise[known] = np.median(lengths[known], axis=1) / MEDIAN_OF_THREE
    return np.maximum(noise, 1e-9)


def weights(e: Array, noise: Array) -> Array:
    """(N,) probability that a pose with residuals e (N, 6) is not a gross error."""
    likely = 0.5 * _worst(e, noise) * (1.0 - WIDE**-2.0)
    odds = np.log(RARE / (1.0 - RARE)) - 3.0 * np.log(WIDE) + likely
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(odds, 500.0))))


def moderate(e: Array, noise: Array) -> Mask:
    """(N,) poses whose residuals e (N, 6) are an arm's errors, not a person's."""
    return np.asarray(_worst(e, noise) < BEYOND**2)


def _worst(e: Array, noise: Array) -> Array:
    """(N,) squared residual of place or turn, whichever is larger, in units of noise."""
    worst = np.zeros(len(e))
    for k, block in enumerate((slice(0, 3), slice(3, 6))):
        if np.isfinite(e[:, block]).any():
            worst = np.fmax(worst, (e[:, block] ** 2).sum(axis=1) / noise[k] ** 2)
    return worst
