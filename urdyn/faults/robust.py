"""Level and spread of noise with outliers, and how much of colour and change is left in it."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from urdyn.faults.alternatives import CLIP
from urdyn.types import MAD_TO_SD, Array

BATCH = 25  # steps over which colour shows in a mean, and a change of the spread in a mean square
SLOW = 50  # steps over which a swing shows that no autoregression foresees
ROUNDS = 50  # of level and spread, each in the light of the other
PEAK = float(np.sqrt(2.0))  # of a swing over its standard deviation, as a sine has it

# Of a standard normal clipped: the expected square.
SQUARE = float(
    2.0 * ndtr(CLIP) - 1.0 - 2.0 * CLIP * np.exp(-0.5 * CLIP**2) / np.sqrt(2.0 * np.pi)
    + 2.0 * CLIP**2 * ndtr(-CLIP)
)  # fmt: skip


def level_and_spread(x: Array) -> tuple[float, float]:
    """Huber's proposal 2 [Huber1981]_: x clipped at CLIP spreads about them as a normal would.

    So that healthy noise, clipped, has the moments that a test of clipped normals expects,
    however long its tails. Where x is mostly one number there is no such spread: it would shrink
    to nothing, and the standard deviation stands for it.
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
    """Whether all else, though it were all at CLIP, is too rare for a normal's square.

    So it is of a sensor that rounds to steps of three sd or more, and of rare events that are
    counted.
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
    """How far the mean of white noise swings about its level at its peak, in the noise's unit."""
    return PEAK * float(np.sqrt(_beyond_chance(white, SLOW)))


def swings(innovations: Array) -> Array:
    """The same of streams, (N, n), outliers apart; NaN where nothing was measured."""
    return np.array([swing(np.clip(x[np.isfinite(x)], -CLIP, CLIP)) for x in innovations.T])


def restlessness(white: Array) -> float:
    """Variance of white noise where it is most restless over that of all of it; 1 or more."""
    square = white**2
    return 1.0 + PEAK * float(np.sqrt(_beyond_chance(square / square.mean(), BATCH)))


def _beyond_chance(x: Array, steps: int) -> float:
    """Variance of means over so many steps beside that of independent ones; 0 where chance does it.

    That is three standard errors: white streams taken for restless would be judged later.
    """
    means = _means(x, steps)
    if len(means) < 2:
        return 0.0
    found, due = float(means.var(ddof=1)), float(x.var()) / steps
    return found - due if found > _chance(means, 3.0) * due else 0.0


def _means(x: Array, steps: int) -> Array:
    """Of batches of so many steps; the last ones of x, fewer than a batch, are left out."""
    return np.asarray(x[: len(x) // steps * steps].reshape(-1, steps).mean(axis=1))


def _chance(means: Array, sds: float = 2.0) -> float:
    """What a variance of so many means may be by chance, over the expected one."""
    return 1.0 + sds * float(np.sqrt(2.0 / (len(means) - 1)))
