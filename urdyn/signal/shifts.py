"""Shifts of an encoder's zero: an angle that jumps where its velocity tells of no motion."""

from __future__ import annotations

import numpy as np

from urdyn.signal.gate import furthest
from urdyn.types import Array, Index

STANDING = 0.02  # [rad/s] slower than this, no wrong stamp looks like a shift


def shifts(t: Array, q: Array, v: Array, half: int) -> Array:
    """By how much every encoder's zero jumped from the row before, (n, J) [rad]; mostly 0.

    A shift is told where it can be nothing else: it is beyond what an arm can do between two rows,
    stands alone among all joints for `half` rows to either side (a torn sample jumps back), and is
    no row with a wrong stamp, which all joints that move would show. In the last row it may still
    jump back.

    Args:
        t: stamps (n,) [s].
        q: angles (n, J) [rad], NaN where not measured.
        v: velocities (n, J) [rad/s], of a sensor or an estimator that the jump has not reached.
    """
    found = np.zeros_like(q)
    way, reach = _unexplained(t, q, v)
    beyond = np.abs(way) > reach
    count, rows = np.cumsum([0, *np.count_nonzero(beyond, axis=1)]), np.arange(len(t))
    near = count[np.minimum(rows + half + 1, len(t))] - count[np.maximum(rows - half, 0)]
    for k, j in np.argwhere(beyond & (near == 1)[:, None]):
        if not _late(way[k], reach[k], v[k], j):
            found[k, j] = way[k, j]
    return found


def without_turns(shift: Array) -> Array:
    """Shifts of zeros less whole turns, by which some recorders keep angles within ± pi [rad]."""
    return np.asarray(shift - 2.0 * np.pi * np.round(shift / (2.0 * np.pi)))


def _unexplained(t: Array, q: Array, v: Array) -> tuple[Array, Array]:
    """Of each joint's way from the last row that was measured, what velocities do not explain.

    By trapezoids; the reach is how far off they may be.
    """
    way, reach = np.zeros_like(q), np.full_like(q, np.inf)
    for j in range(q.shape[1]):
        rows: Index = np.flatnonzero(np.isfinite(q[:, j]) & np.isfinite(v[:, j]))
        dt, known, speed = np.diff(t[rows]), rows[1:], v[rows, j]
        way[known, j] = np.diff(q[rows, j]) - 0.5 * dt * (speed[1:] + speed[:-1])
        change = np.pad(np.abs(np.diff(speed)), 1)
        around = np.max([change[:-2], change[1:-1], change[2:]], axis=0)
        reach[known, j] = furthest(dt, np.fmax(np.abs(speed[1:]), np.abs(speed[:-1])), around)
    return way, reach


def _late(way: Array, reach: Array, v: Array, j: int) -> bool:
    """Whether a wrong stamp may have made joint j's jump: no other joint tells that it did not."""
    if abs(v[j]) < STANDING:
        return False
    would = np.abs(np.delete(v * way[j] / v[j], j))  # of the others, which have shown nothing
    return bool(np.nanmax(would / np.delete(reach, j), initial=0.0) < 2.0)
