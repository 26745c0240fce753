"""Shifts of an encoder's zero: an angle jumps while nothing else shows a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from urdyn.signal.gate import FINEST, REACH, STAMP, furthest
from urdyn.types import STANDSTILL, Array, Index, Mask

TELLING = 4.0  # [-] a wrong stamp's effect over scatter, and over what is seen, that rules it out
JITTER = 3e-5  # [rad] of encoders: two steps
ALONE = 2.0  # [-] times the misfit of rows beside a jump: ringing is in all of them
UNDONE = 0.2  # [-] of a displacement or jump, by which its return may differ from it
SHAKEN = 0.1  # [s] after a jump, while the controller reacts, in which nothing else counts as one
MISLED = 0.04  # [s] for which a jump may distort a velocity that is computed from angles


@dataclass(frozen=True, eq=False)
class Leap:
    """A jump of zeros."""

    t: float  # [s]
    by: Array  # (J,) [rad]; () of none


NEVER = Leap(-np.inf, np.zeros(()))


class Jumps(NamedTuple):
    """Where zeros jumped, and which velocities that distorted."""

    shift: Array  # (n, J) [rad] since the row before; mostly 0
    misled: Mask  # (n, J)


def jumps(t: Array, q: Array, v: Array, half: int, last: Leap = NEVER) -> Jumps:
    """By how much every encoder's zero jumped from the row before.

    A shift is reported where it can be nothing else: it is beyond what an arm can do between two
    rows, stands alone among all joints for `half` rows to either side (a torn sample jumps back),
    and is not due to a wrong stamp, which all moving joints would show. In the last row it may
    still jump back.

    It is judged by velocities of a sensor or an estimator that the jump has not reached. Where they
    followed it, the steps before and after judge; impossible steps of that joint, and of others
    that it shakes, may then follow the jump but not precede it.

    Args:
        t: stamps (n,) [s].
        q: angles (n, J) [rad], NaN where not measured.
        v: velocities (n, J) [rad/s], likewise.
        last: the jump before.
    """
    told, misled = np.zeros_like(q), np.zeros(q.shape, dtype=bool)
    way, reach, since = _beside_speeds(t, q, v)
    apart = np.abs(way) > reach
    leap, before, leaps = _beside_ways(t, q, v)
    beyond = apart | leaps
    if not np.count_nonzero(beyond):
        return Jumps(told, misled)
    step = np.diff(t, prepend=t[0])
    alone = apart & (_count(beyond, half, half).sum(axis=1, keepdims=True) == 1)
    own = _count(beyond, 1, 0)  # a mean around the row before has it too
    first = _count(beyond, half, 0).sum(axis=1, keepdims=True) == own
    for k, j in np.argwhere(leaps & ~alone & first & (_count(leaps, half, half) == 1)):
        finest = _scatter(way, reach, k, half)
        if not _late(step[k], leap[k, j], before[k], way[k], finest, j):
            told[k, j] = leap[k, j]
            misled[max(k - 1, 0) : np.searchsorted(t, t[k] + MISLED), j] = True
    if np.count_nonzero(told):
        rest = jumps(t, q - np.cumsum(told, axis=0), np.where(misled, np.nan, v), half)
        return Jumps(_first(t, told + rest.shift, last), misled | rest.misled)
    for k, j in np.argwhere(alone):
        beside = np.delete(way[max(k - half, 0) : k + half + 1, j], min(k, half))
        # Over n rows the same acceleration is n² times as far off.
        rings = np.abs(beside).max(initial=0.0) * ALONE * since[k, j] ** 2 > abs(way[k, j])
        finest = _scatter(way, reach, k, half)
        if not rings and not _late(step[k], way[k, j], v[k], way[k], finest, j):
            told[k, j] = way[k, j]
    return Jumps(_first(t, told, last), misled)


def without_turns(shift: Array) -> Array:
    """Shifts of zeros less whole turns, by which some recorders keep angles within ± pi [rad]."""
    return np.asarray(shift - 2.0 * np.pi * np.round(shift / (2.0 * np.pi)))


def _beside_speeds(t: Array, q: Array, v: Array) -> tuple[Array, Array, Array]:
    """The part of each joint's step since its last measured row that velocities do not explain.

    By trapezoids; with it, the reach: how far off they may be; and how many rows the step takes.
    """
    way, reach, since = np.zeros_like(q), np.full_like(q, np.inf), np.ones_like(q)
    for j in range(q.shape[1]):
        rows: Index = np.flatnonzero(np.isfinite(q[:, j]) & np.isfinite(v[:, j]))
        dt, known, speed = np.diff(t[rows]), rows[1:], v[rows, j]
        way[known, j] = np.diff(q[rows, j]) - 0.5 * dt * (speed[1:] + speed[:-1])
        since[known, j] = np.diff(rows)
        change = np.pad(np.abs(np.diff(speed)), 1)
        around = np.max([change[:-2], change[1:-1], change[2:]], axis=0)
        reach[known, j] = furthest(dt, np.fmax(np.abs(speed[1:]), np.abs(speed[:-1])), around)
    return way, reach, since


def _beside_ways(t: Array, q: Array, v: Array) -> tuple[Array, Array, Mask]:
    """The part of each joint's step that the step before does not explain, and the latter's speed.

    It is beyond an arm where REACH, from the speed before, does not come that far, and the step
    after explains it no better: a speed that jumps persists, and a torn sample goes back, twice as
    far from the one as from the other.
    """
    way, speed, beyond = np.zeros_like(q), np.full_like(q, np.nan), np.zeros(q.shape, dtype=bool)
    for j in range(q.shape[1]):
        rows: Index = np.flatnonzero(np.isfinite(q[:, j]))
        step, known = np.diff(t[rows]), rows[2:-1]
        mean, dt = np.diff(q[rows, j]) / step, step[1:-1]
        before, after = (dt * (mean[1:-1] - other) for other in (mean[:-2], mean[2:]))
        apart = 0.5 * np.abs(before + after)
        alike = 0.5 * np.abs(before - after) < UNDONE * apart
        quick = np.fmax(np.abs(mean[:-2]), np.abs(mean[2:]))
        most = FINEST + 0.5 * REACH * dt**2 + STAMP * quick
        leapt = np.fmin(apart, dt * np.abs(mean[1:-1] - v[rows[1:-2], j]))
        way[known, j], speed[known, j], beyond[known, j] = before, mean[:-2], alike & (leapt > most)
    return way, speed, beyond


def _count(mask: Mask, before: int, after: int) -> Index:
    """Set cells per column, from `before` rows before to `after` rows after each row, (n, J)."""
    count, row = np.cumsum(np.pad(mask, ((1, 0), (0, 0))), axis=0), np.arange(len(mask))
    end = np.minimum(row + after + 1, len(mask))
    return np.asarray(count[end] - count[np.maximum(row - before, 0)])


def _first(t: Array, told: Array, last: Leap) -> Array:
    """The jumps without those of joints that an earlier jump shakes, (n, J) [rad]."""
    for k in np.flatnonzero((np.abs(without_turns(told)) > FINEST).any(axis=1)):
        if last.t < t[k] < last.t + SHAKEN:
            back = np.abs(told[k] + last.by) < UNDONE * np.abs(last.by)
            told[k] = np.where(back, told[k], 0.0)
        if told[k].any():
            last = Leap(float(t[k]), told[k].copy())
    return told


def _scatter(way: Array, reach: Array, k: int, half: int) -> Array:
    """The most that speeds do not explain in the rows beside row k, (J,) [rad], at most FINEST.

    A wrong stamp spoils two steps, the second of which is in these rows.
    """
    scatter = np.where(np.isfinite(reach), np.abs(way), FINEST)
    beside = np.concatenate([scatter[max(k - half, 1) : k], scatter[k + 1 : k + half + 1]])
    return np.asarray(np.clip(beside.max(axis=0, initial=0.0), JITTER, FINEST))


def _late(dt: float, by: float, speed: Array, way: Array, scatter: Array, j: int) -> bool:
    """Whether a wrong stamp may have made joint j's jump: no other joint disproves it.

    Args:
        dt: step by the stamps [s]; the true one, dt + by / speed, is never negative.
        by: the jump [rad].
        speed: of all joints, (J,) [rad/s].
        way: the part of all joints' steps that speeds do not explain, (J,) [rad].
        scatter: the same in other rows, (J,) [rad].
    """
    if not abs(speed[j]) >= STANDSTILL or by / speed[j] < -dt:
        return False
    would, showed = np.abs(speed * by / speed[j]), np.abs(way)
    tells = (would > TELLING * scatter) & (showed < would / TELLING)
    return not bool(np.any(np.delete(tells, j)))
