"""A part of a long motion that represents the whole."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from urdyn.types import Motion

WINDOWS = 6  # contiguous parts, evenly spread, to cover warm-up and all phases of a program


def excerpt(motion: Motion, rows: int) -> Motion:
    """At most `rows` rows of a motion, in evenly spread windows; the motion itself if shorter."""
    if len(motion) <= rows:
        return motion
    width = rows // WINDOWS
    starts = np.linspace(0, len(motion) - width, WINDOWS).astype(int)
    kept = (starts[:, None] + np.arange(width)).ravel()
    inherited = np.flatnonzero(np.isin(kept, motion.breaks))
    breaks = sorted({*(np.arange(1, WINDOWS) * width).tolist(), *inherited.tolist()} - {0})
    return motion.rows(kept, tuple(breaks))


def folds(motion: Motion, count: int) -> list[Motion]:
    """A motion cut into `count` contiguous parts of equal length."""
    edges = np.linspace(0, len(motion), count + 1).astype(int)
    return [motion.slice(a, b) for a, b in pairwise(edges)]
