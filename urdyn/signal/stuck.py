"""Stuck sensors: a joint's angle or velocity repeats itself while the other one shows a motion.

Angle and velocity measure a joint's motion twice. Where one of them is the same number from row to
row and the other goes further than rounding and offsets explain, the one that repeats itself
measures nothing. A two-sided CUSUM sums up their difference [Page1954]_.

Two things are no evidence: an offset that a velocity had before its joint came to rest, and what a
sensor says that is known to be stuck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.signal.channels import MOTION, has_motion, without
from urdyn.signal.stretches import GAP, median_step
from urdyn.types import Array, Index, Log, Mask

OFFSET = 0.02  # [rad/s] by which a velocity may be off, beyond what it was before
PAST = 4  # steps up to where an angle begins to repeat itself, which tell that
APART = 5e-3  # [rad] beyond the rounding of angles
ROWS = 3  # that have to repeat: an angle that jumps takes only one


@dataclass(frozen=True, eq=False)
class Held:
    """What has repeated itself of late; of angles and velocities, (2, ...)."""

    t: tuple[float, ...]  # (n,) [s] the last stamps, up to PAST + 1
    rows: tuple[Array, ...]  # (n, 2, J) as they came [rad, rad/s]
    apart: Array  # (2, 2, J) [rad] CUSUMs of the motion it missed, either way; inf: it is stuck
    since: Array  # (2, J) [s] stamp since which it repeats itself
    rests: Mask  # (J,) the angle is that of the row before
    off: Array  # (J,) [rad/s] by which its velocity was off before


def nothing_held(t: float, row: Array, before: Held | None = None) -> Held:
    """The state after a row, (2, J), that is the first, or repeats nothing of the one before."""
    shape, none = row.shape, np.zeros(row.shape[1])
    lately = ((t,), (row,)) if before is None else _lately(before, t, row)
    return Held(*lately, np.zeros((2, *shape)), np.full(shape, t), none > 0.0, none)


def _lately(held: Held, t: float, row: Array) -> tuple[tuple[float, ...], tuple[Array, ...]]:
    return (*held.t[-PAST:], t), (*held.rows[-PAST:], row)


def after(held: Held, t: float, dt: float, row: Array) -> Held:
    """The state after one more row, (2, J) [rad, rad/s], NaN where not measured."""
    last = held.rows[-1]
    same = row == last
    if not np.count_nonzero(same):
        return nothing_held(t, row, held)
    rests, off = same[0], held.off * same[0]
    if np.count_nonzero(begins := rests & ~held.rests):
        off[begins] = _off(held.t, held.rows)[begins]
    way = _within_reach(_between(last, row, dt))
    further = np.array([way + dt * np.fmin(off, 0.0), -way - dt * np.fmax(off, 0.0)]) - OFFSET * dt
    apart = np.where(same, np.fmax(held.apart + further[:, None], 0.0), 0.0)
    apart[apart >= APART] = np.inf
    if np.count_nonzero(known := stuck(held)):
        apart = np.where(same & known[::-1], held.apart, apart)
    since = np.where(apart.any(axis=0), held.since, t)
    return Held(*_lately(held, t, row), apart, since, rests, off)


def _off(t: Sequence[float] | Array, rows: Sequence[Array] | Array) -> Array:
    """By how much velocities exceed the angles' rates in rows, (n, 2, J); (J,) [rad/s]."""
    if len(t) < 2:
        return np.zeros(rows[0].shape[1])
    of, at = np.asarray(rows), np.asarray(t)
    way = _between(of[:-1], of[1:], np.diff(at)[:, None])
    return np.asarray(-_within_reach(way).sum(axis=0) / (at[-1] - at[0]))


def _within_reach(way: Array) -> Array:
    """Ways [rad] of which it takes ROWS to be APART; 0 where not measured."""
    way = np.minimum(np.maximum(way, -APART / ROWS), APART / ROWS)
    way[np.isnan(way)] = 0.0
    return way


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
    opened = _last(~near)
    halted = _last((q[1:] != q[:-1]) | ~near[:, None])

    def at(k: int) -> Held:
        """The state after row k, where nothing is apart yet."""
        of, *before = (slice(max(opened[i], i - PAST), i + 1) for i in (k, *halted[k]))
        off = [_off(t[since], rows[since])[j] for j, since in enumerate(before)]
        rests, nothing = halted[k] < k, nothing_held(t[k], rows[k])
        lately = replace(nothing, t=tuple(t[of]), rows=tuple(rows[of]))
        return replace(lately, rests=rests, off=np.where(rests, off, 0.0))

    k = 0
    for begin in np.flatnonzero(apart.any(axis=1) & near).tolist():
        if begin < k:
            continue
        k, held, before = begin, at(begin), found[begin]
        while k < len(near) and near[k] and (k == begin or held.apart.any()):
            k, held = k + 1, after(held, t[k + 1], float(dt[k, 0]), rows[k + 1])
            found[k] = now = stuck(held)
            if np.count_nonzero(new := now & ~before):
                found[begin:k] |= (t[begin:k, None, None] > held.since) & new
            before = now
    return found


def _last(changes: Mask) -> Index:
    """The last row, up to each, that begins something new, (N, ...); the first one does.

    Args:
        changes: whether a row does, of all but the first, (N - 1, ...).
    """
    row = np.arange(1, len(changes) + 1).reshape(-1, *(1,) * (changes.ndim - 1))
    first = np.zeros((1, *changes.shape[1:]), dtype=np.intp)
    return np.maximum.accumulate(np.concatenate([first, np.where(changes, row, 0)]), axis=0)


def without_stuck(log: Log) -> Log:
    """A log in which angles and velocities of sensors that are stuck count as not measured."""
    if not has_motion(log):
        return log
    ill = ever_stuck(log.t, *map(log.joint, MOTION))
    kind = "angle or velocity that is the same while its joint moves"
    return without(log, ill.swapaxes(0, 1), kind)
