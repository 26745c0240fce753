"""Level and spread of noise with outliers, and how much colour and change remain in it."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from urdyn.faults.alternatives import CLIP
from urdyn.types import MAD_TO_SD, Array

BATCH = 25  # steps over which colour shows in a mean, and a change of the spread in a mean square
SLOW = 50  # steps over which a swing shows that no autoregression predicts
ROUNDS = 50  # of level and spread, each given the other
PEAK = float(np.sqrt(2.0))  # peak of a swing over its standard deviation, as for a sine

# Expected square of a clipped standard normal.
SQUARE = float(
    2.0 * ndtr(CLIP) - 1.0 - 2.0 * CLIP * np.exp(-0.5 * CLIP**2) / np.sqrt(2.0 * np.pi)
    + 2.0 * CLIP**2 * ndtr(-CLIP)
)  # fmt: skip


def level_and_spread(x: Array) -> tuple[float, float]:
    """Huber's proposal 2 [Huber1981]_: x clipped at CLIP about them spreads like a normal.

    Healthy noise, clipped, then has the moments that a test of clipped normals expects, however
    long its tails. Where x is mostly one number there is no such spread: it would shrink to
    nothing, so the standard deviation replaces it.
    """
    level = float(np.median(x))
    spread = MAD_TO_SD * float(np.median(np.abs(x - level))) or float(np.std(x - level))
    least = spread if is_mostly_one_number(x) else 0.0
    for _ in range(ROUNDS):
        if not spread > 0.0:
            break
        clipped = np.clip((x - level) / spread, -CLIP, CLIP)
        inside = float((np.abs(clipped) < CLIP).mean())
        level += spread * float(clipped.mean()) / max(inside, 0.1)
        wider = np.sqrt(float((clipped**2).mean()) / SQUARE)
        spread = max(spread * wider, least)
        if abs(wider - 1.0) < 1e-6:
            break
    return level, spread


def is_mostly_one_number(x: Array) -> bool:
    """Whether other values, were they all at CLIP, are too rare for a normal's square.

    True of a sensor that rounds to steps of three sd or more, and of counts of rare events.
    """
    return float((x != np.median(x)).mean()) * CLIP**2 < SQUARE


def long_run_excess(white: Array) -> float:
    """Variance of batch means over that of white noise, beyond what chance explains; 1 or more."""
    means = _means(white, BATCH)
    if len(means) < 2:
        return 1.0
    ratio = BATCH * float(means.var(ddof=1)) / float(white.var())
    return float(max(1.0, ratio / _chance(means)))


def swing(white: Array) -> float:
    """Peak swing of the mean of white noise about its level, in the noise's unit."""
    return PEAK * float(np.sqrt(_beyond_chance(white, SLOW)))


def swings(innovations: Array) -> Array:
    """The same of streams, (N, n), outliers clipped; NaN where nothing was measured."""
    return np.array([swing(np.clip(x[np.isfinite(x)], -CLIP, CLIP)) for x in innovations.T])


def restlessness(white: Array) -> float:
    """Peak variance of white noise over that of all of it; 1 or more."""
    square = white**2
    return 1.0 + PEAK * float(np.sqrt(_beyond_chance(square / square.mean(), BATCH)))


def _beyond_chance(x: Array, steps: int) -> float:
    """Variance of means over so many steps beyond that of independent ones; 0 within chance.

    Chance is three standard errors: white streams taken for restless would be judged later.
    """
    means = _means(x, steps)
    if len(means) < 2:
        return 0.0
    found, due = float(means.var(ddof=1)), float(x.var()) / steps
    return found - due if found > _chance(means, 3.0) * due else 0.0


def _means(x: Array, steps: int) -> Array:
    """Means of batches of so many steps; the last ones of x, fewer than a batch, are left out."""
    return np.asarray(x[: len(x) // steps * steps].reshape(-1, steps).mean(axis=1))


def _chance(means: Array, sds: float = 2.0) -> float:
    """Most that a variance of so many means may be by chance, over the expected one."""
    return 1.0 + sds * float(np.sqrt(2.0 / (len(means) - 1)))
