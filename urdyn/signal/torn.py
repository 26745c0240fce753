"""Single angles and velocities that no arm can have had: far from the rows before and after.

A recorder writes such a row once in a while: of another time, of zeros, or with a bit flipped.
Live, `Gate` refuses what is too far from the row before; in a whole recording the row after counts,
too, so that an encoder's zero that jumps, and stays, is not torn.
"""

from __future__ import annotations

import numpy as np

from urdyn.signal.channels import MOTION, has_motion, without
from urdyn.signal.gate import FINEST, Gate
from urdyn.signal.polynomial import half_window
from urdyn.signal.shifts import jumps
from urdyn.signal.stretches import GAP, median_step
from urdyn.types import Array, Log, Mask

RARE = 0.01  # [-] of all values
USUAL = 18  # departures that show what is usual for a sensor: as many as are remembered live


def ever_torn(t: Array, q: Array, v: Array) -> Mask:
    """Which of a recording's angles and velocities are torn, (2, N, J).

    Args:
        t: stamps (N,) [s].
        q: angles (N, J) [rad], NaN where not measured.
        v: velocities (N, J) [rad/s], likewise.
    """
    rows, dt, gate = np.stack([q, v]), np.diff(t)[:, None], Gate()
    apart = gate.departure(rows[:, :-1], rows[:, 1:], dt)
    reach = np.stack([np.full_like(dt, FINEST), gate.acceleration * dt])
    beyond = (apart > reach) & (dt <= GAP * median_step(t))
    both = beyond[:, :-1] & beyond[:, 1:]
    found = np.zeros(rows.shape, dtype=bool)
    for k in np.flatnonzero(both.any(axis=(0, 2))).tolist():
        usual = apart[:, max(k - USUAL, 0) : max(k, 1)].swapaxes(0, 1)
        there, back = (
            gate.refuses(apart[:, at], usual, float(dt[at, 0]), (v[at], v[at + 1]))
            for at in (k, k + 1)
        )
        found[:, k + 1] = both[:, k] & there & back
    return found


def without_torn(log: Log) -> Log:
    """A log in which torn values count as not measured; unchanged where they are many.

    In a wrong unit or column all are out of reach, which other checks report.
    """
    if not has_motion(log) or not median_step(log.t) > 0.0:
        return log
    q, v = map(log.joint, MOTION)
    ill = ever_torn(log.t, q, v)
    if ill.any():  # a zero that jumps may tear velocities computed from angles
        shift, misled = jumps(log.t, q, v, half_window(median_step(log.t)))
        stays = np.cumsum(shift, axis=0)
        ill = ever_torn(log.t, q - stays, np.where(misled, np.nan, v))
    if np.count_nonzero(ill) >= RARE * q.size:
        return log
    return without(log, ill, "angle or velocity out of reach of the rows beside it")
