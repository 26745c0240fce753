"""Level and spread of noise with outliers, and how much of its colour is left."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from urdyn.faults.alternatives import CLIP
from urdyn.types import MAD_TO_SD, Array

BATCH = 25  # steps over which colour shows in a mean

# Of a standard normal clipped: the expected square.
SQUARE = float(
    2.0 * ndtr(CLIP) - 1.0 - 2.0 * CLIP * np.exp(-0.5 * CLIP**2) / np.sqrt(2.0 * np.pi)
    + 2.0 * CLIP**2 * ndtr(-CLIP)
)  # fmt: skip


def level_and_spread(x: Array, rounds: int = 50) -> tuple[float, float]:
    """Huber's proposal 2 [Huber1981]_: x clipped at CLIP spreads about them as a normal would.

    So that healthy noise, clipped, has the moments that a test of clipped normals expects,
    however long its tails.
    """
    level = float(np.median(x))
    spread = MAD_TO_SD * float(np.median(np.abs(x - level))) or float(np.std(x))
    for _ in range(rounds):
        if not spread > 0.0:
            break
        clipped = np.clip((x - level) / spread, -CLIP, CLIP)
        inside = float((np.abs(clipped) < CLIP).mean())
        level += spread * float(clipped.mean()) / max(inside, 0.1)
        wider = np.sqrt(float((clipped**2).mean()) / SQUARE)
        spread *= wider
        if abs(wider - 1.0) < 1e-6:
            break
    return level, spread


def long_run_excess(white: Array) -> float:
    """Variance of batch means over that of white noise, beyond what chance explains; 1 or more."""
    batches = len(white) // BATCH
    if batches < 2:
        return 1.0
    means = white[: batches * BATCH].reshape(batches, BATCH).mean(axis=1)
    ratio = BATCH * float(means.var(ddof=1)) / float(white.var())
    chance = 1.0 + 2.0 * np.sqrt(2.0 / (batches - 1))
    return float(max(1.0, ratio / chance))
