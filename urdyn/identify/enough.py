"""How much of a recording tells anything of an arm."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Mask

MIN_ROWS = 200
SPAN = 50  # rows whose median encoders of an arm that stands hardly move
MOVED = 0.01  # [rad] by which a joint goes somewhere


def too_few(current: Array) -> str:
    """Why currents (N, J) [A] tell nothing; nothing where there are enough."""
    measured = np.isfinite(current).any(axis=1).sum()
    if measured >= MIN_ROWS:
        return ""
    told = f"{measured} rows with a current are too few"
    return f"{told}; record at least {MIN_ROWS}, better 20 s of motion of every joint"


def goes_somewhere(q: Array) -> Mask:
    """Which joints do, (J,), of angles (N, J) [rad]: the noise of one that stands adds up, too."""
    told = q[np.isfinite(q).all(axis=1)]
    at = np.median(told[: len(told) // SPAN * SPAN].reshape(-1, SPAN, q.shape[1]), axis=1)
    return np.asarray(at.max(axis=0, initial=-np.inf) - at.min(axis=0, initial=np.inf) > MOVED)


def dead(q: Array, current: Array) -> Mask:
    """Which joints go somewhere at a current (N, J) [A] that never changes, (J,): it is none.

    Where none of all changes it is the log that has no currents, and no sensor's fault.
    """
    same = np.fmin.reduce(current) == np.fmax.reduce(current)
    return np.asarray(same & ~same.all() & goes_somewhere(q))
