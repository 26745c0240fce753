"""Stuck sensors: a joint's angle or velocity repeats itself while the other one shows a motion.

Angle and velocity measure a joint's motion twice. Where one of them is the same number from row to
row and the other goes further than rounding and offsets explain, the one that repeats itself
measures nothing. A two-sided CUSUM sums up their difference [Page1954]_.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.signal.channels import noted
from urdyn.signal.stretches import GAP, median_step
from urdyn.types import Array, Log, Mask

OFFSET = 0.02  # [rad/s] by which a velocity may be off permanently
APART = 5e-3  # [rad] beyond the rounding of angles
ROWS = 3  # that have to repeat: an angle that jumps takes only one


@dataclass(frozen=True, eq=False)
class Held:
    """What has repeated itself of late; of angles and velocities, (2, ...)."""

    last: Array  # (2, J) as they came [rad, rad/s]
    apart: Array  # (2, 2, J) [rad] CUSUMs of the motion it missed, either way; inf: it is stuck
    since: Array  # (2, J) [s] stamp since which it repeats itself


def nothing_held(t: float, row: Array) -> Held:
    """The state after a first row, (2, J)."""
    return Held(row, np.zeros((2, *row.shape)), np.full(row.shape, t))


def after(held: Held, t: float, dt: float, row: Array) -> Held:
    """The state after one more row, (2, J) [rad, rad/s], NaN where not measured."""
    same = row == held.last
    if not np.count_nonzero(same):
        return nothing_held(t, row)
    way = np.minimum(np.maximum(_between(held.last, row, dt), -APART / ROWS), APART / ROWS)
    way[np.isnan(way)] = 0.0
    further = np.array([way, -way]) - OFFSET * dt
    apart = np.where(same, np.fmax(held.apart + further[:, None], 0.0), 0.0)
    apart[apart >= APART] = np.inf
    return Held(row, apart, np.where(apart.any(axis=0), held.since, t))


def _between(before: Array, row: Array, dt: Array | float) -> Array:
    """By how much an angle went further than its velocity since the row before, (..., J) [rad]."""
    of_q, of_v = row[..., 0, :] - before[..., 0, :], row[..., 1, :] + before[..., 1, :]
    return np.asarray(of_q - 0.5 * dt * of_v)


def stuck(held: Held) -> Mask:
    """Which angles and velocities are stuck, (2, J), in all rows after `since`."""
    return np.asarray(np.isinf(held.apart).any(axis=0))


def ever_stuck(t: Array, q: Array, v: Array) -> Mask:
    """Which of a recording's angles and velocities are of a stuck sensor, (N, 2, J).

    Args:
        t: stamps (N,) [s].
        q: angles (N, J) [rad], NaN where not measured.
        v: velocities (N, J) [rad/s], likewise.
    """
    rows, dt = np.stack([q, v], axis=1), np.diff(t)[:, None]
    found = np.zeros(rows.shape, dtype=bool)
    near = dt[:, 0] <= GAP * median_step(t)
    way = _between(rows[:-1], rows[1:], dt)
    apart = (rows[1:] == rows[:-1]).any(axis=1) & (np.abs(way) > OFFSET * dt)
    k = 0
    for begin in np.flatnonzero(apart.any(axis=1) & near).tolist():
        if begin < k:
            continue
        k, held, before = begin, nothing_held(t[begin], rows[begin]), found[begin]
        while k < len(near) and near[k] and (k == begin or held.apart.any()):
            k, held = k + 1, after(held, t[k + 1], float(dt[k, 0]), rows[k + 1])
            found[k] = now = stuck(held)
            if np.count_nonzero(new := now & ~before):
                found[begin:k] |= (t[begin:k, None, None] > held.since) & new
            before = now
    return found


def without_stuck(log: Log) -> Log:
    """A log in which angles and velocities of sensors that are stuck count as not measured."""
    names = ("actual_q", "actual_qd")
    if not all(name in log for name in names):
        return log
    values = [log.joint(name) for name in names]
    ill = ever_stuck(log.t, *values)
    if not (count := int(np.count_nonzero(ill))):
        return log
    told = {name: np.where(ill[:, k], np.nan, values[k]) for k, name in enumerate(names)}
    kind = "angle or velocity that is the same while its joint moves"
    defects = noted(log, kind, count, "taken as not measured")
    return replace(log, channels={**log.channels, **told}, defects=defects)
