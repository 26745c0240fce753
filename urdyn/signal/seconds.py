"""What stamps count: velocities say how long an angle took to change by as much as it did."""

from __future__ import annotations

import numpy as np

from urdyn.signal.stretches import GAP
from urdyn.types import Array, Log

MOVES = 0.02  # [rad/s] more than a joint that stands is said to turn by
ENOUGH = 20  # rows in which a joint moves
# By which steps of angles are too small where stamps count these. Half a decade either way is
# more than a velocity is off, and less than any other mistake would do.
UNITS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
DECADES = 0.5


def unit(log: Log) -> str:
    """What its stamps count where that surely is no seconds; "" where it is, or nobody can tell.

    Where most of what moves agrees: noise around a joint that stands does not.
    """
    if not {"actual_q", "actual_qd"} <= set(log.channels):
        return ""
    shares = _shares(log.t, log.joint("actual_q"), log.joint("actual_qd"))
    most = np.quantile(shares, [0.25, 0.75]) if len(shares) else np.zeros(1)
    if not (most > 0.0).all():
        return ""
    off = {name: np.abs(np.log10(most / step)).max() for name, step in UNITS.items()}
    return next((name for name in UNITS if off[name] < DECADES), "")


def _shares(t: Array, q: Array, v: Array) -> Array:
    """Steps of angles over what velocities make of the time between [-], of all that moves, (k,).

    Args:
        t: stamps (N,), of any unit.
        q: angles (N, J) [rad].
        v: velocities (N, J) [rad/s].
    """
    dt, shares = np.diff(t), [np.zeros(0)]
    near = dt <= GAP * np.median(dt) if len(dt) else dt > 0.0
    for of_q, of_v in zip(q.T, v.T, strict=True):
        step, speed = np.diff(of_q), 0.5 * (of_v[1:] + of_v[:-1])
        moves = near & (dt > 0.0) & np.isfinite(step) & (np.abs(speed) > MOVES) & np.isfinite(speed)
        if np.count_nonzero(moves) >= ENOUGH:
            shares.append(step[moves] / (speed[moves] * dt[moves]))
    return np.concatenate(shares)
