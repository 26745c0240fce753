"""Whether a recording contains enough to identify an arm."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Mask

MIN_ROWS = 200
SPAN = 50  # rows over whose median a resting arm's encoders hardly move
MOVED = 0.01  # [rad] by which a moving joint moves


def too_few(current: Array) -> str:
    """Why currents (N, J) [A] are too few; "" where there are enough."""
    measured = np.isfinite(current).any(axis=1).sum()
    if measured >= MIN_ROWS:
        return ""
    told = f"{measured} rows with a current are too few"
    return f"{told}; record at least {MIN_ROWS}, better 20 s of motion of every joint"


def goes_somewhere(q: Array) -> Mask:
    """Which joints move, (J,), from angles (N, J) [rad]; medians, as noise can look like motion."""
    told = q[np.isfinite(q).all(axis=1)]
    at = np.median(told[: len(told) // SPAN * SPAN].reshape(-1, SPAN, q.shape[1]), axis=1)
    return np.asarray(at.max(axis=0, initial=-np.inf) - at.min(axis=0, initial=np.inf) > MOVED)


def dead(q: Array, current: Array) -> Mask:
    """Joints that move while their current (N, J) [A] never changes, which is no measurement, (J,).

    Where no current changes at all, the log lacks currents, and no sensor is at fault.
    """
    same = np.fmin.reduce(current) == np.fmax.reduce(current)
    return np.asarray(same & ~same.all() & goes_somewhere(q))
