"""Units of a log, checked by its velocities: they give the duration of each change of angle."""

from __future__ import annotations

import numpy as np

from urdyn.signal.channels import MOTION, has_motion
from urdyn.signal.stretches import GAP
from urdyn.types import STANDSTILL, Array, Log

ENOUGH = 20  # rows in which a joint moves
MANY = 100_000  # evenly spaced rows that are examined in a longer log
# Angle step over velocity times time step, where stamps count these units, or where velocities or
# angles are in degrees. Half a decade either way is more than a velocity's error, and less than the
# effect of any other mistake.
STAMPS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
DEGREES = {"velocities": float(np.radians(1.0)), "angles": float(np.degrees(1.0))}
DECADES = 0.5
ROWS = "rows"  # counted by stamps that are one apart, unless these are exact in another unit
EXCHANGED = "exchanged"  # angles and velocities, in each other's columns
EXACT = 0.1  # decades by which velocities are off at most, where stamps are exact
SLIP = 0.05  # [rad] more than any joint moves without a velocity
TINY = 1e-300  # [rad]
COLUMN = {"velocities": "actual_qd", "angles": "actual_q"}
DUE = {"velocities": "rad/s: is it deg/s?", "angles": "rad: is it degrees?"}


def wrong_unit(log: Log) -> str:
    """What is wrong, as a key of `STAMPS` or `DEGREES`; "" if all is in SI.

    Also `ROWS`, where stamps are row numbers, and `EXCHANGED`.

    Reported only where most of the motion agrees on it: velocities without motion, such as the
    noise of a joint at rest, do not.
    """
    if not has_motion(log):
        return ""
    q, v = map(log.joint, MOTION)
    most = quartiles(log.t, q, v)
    if not (most > 0.0).all():
        return EXCHANGED if near_one(quartiles(log.t, v, q), DECADES) else ""
    decades_of_ms = np.abs(np.log10(most / STAMPS["milliseconds"])).min()
    if (np.diff(log.t) == 1.0).all() and (most < 10.0**-DECADES).all() and decades_of_ms > EXACT:
        return ROWS
    off = {name: np.abs(np.log10(most / by)).max() for name, by in (STAMPS | DEGREES).items()}
    return next((name for name, decades in off.items() if decades < DECADES), "")


def unfilled(log: Log) -> bool:
    """Whether its velocities are zeros, never filled in, while its angles change."""
    q, v = map(log.joint, MOTION)
    nothing = (v == 0.0).any() and not np.nan_to_num(v).any()
    return bool(nothing and (np.nanmax(q, axis=0) - np.nanmin(q, axis=0) > SLIP).any())


def complaint(unit: str) -> tuple[str, str]:
    """One sentence on what is wrong with a log of this `wrong_unit`, and the column to blame."""
    if unit == ROWS:
        return "its stamps count rows; skip them by - in --columns, and say the --rate", "timestamp"
    if unit == EXCHANGED:
        return "its angles are velocities, and these its angles: exchange their columns", "actual_q"
    if unit in STAMPS:
        return (
            f"its stamps are {unit}: by its velocities angles change {1.0 / STAMPS[unit]:,.0f} "
            "times too slowly; stamps are to be in s: divide them",
            "timestamp",
        )
    by = DEGREES[unit]
    pace = f"{by:.0f} times as fast" if by > 1.0 else f"at 1 / {1.0 / by:.0f} of the pace"
    return (
        f"its velocities do not fit its angles: these change {pace}; "
        f"{unit} are to be in {DUE[unit]}",
        COLUMN[unit],
    )


def near_one(shares: Array, decades: float) -> bool:
    """Whether all shares [-] are above 0, and within so many decades of 1."""
    return bool((shares > 0.0).all() and np.abs(np.log10(shares)).max() < decades)


def quartiles(t: Array, q: Array, v: Array) -> Array:
    """Quartiles of angle steps over velocity times time, (2,) [-]; 0 where too little moves.

    Args:
        t: stamps (N,), of any unit.
        q: angles (N, J) [rad].
        v: velocities (N, J) [rad/s].
    """
    return _middle(*_shares(t, q, v))


def _middle(shares: Array, ways: Array) -> Array:
    """Quartiles of the shares [-], (2,), weighted by displacement [rad]; 0 where too few count."""
    part = ways / max(ways.max(initial=0.0), TINY)
    gone = float(part.sum())
    if gone**2 < ENOUGH * float(part @ part) or not gone:  # a few torn rows dominate
        return np.zeros(2)
    order = np.argsort(shares)
    passed = np.searchsorted(np.cumsum(part[order]), gone * np.array([0.25, 0.75]))
    return np.asarray(shares[order[passed]])


def _shares(t: Array, q: Array, v: Array) -> tuple[Array, Array]:
    """Angle step over velocity times time [-], where joints move, and the latter, (k,) [rad]."""
    k = np.arange(0, len(t) - 1, 1 + len(t) // MANY)
    dt, shares, ways = t[k + 1] - t[k], [np.zeros(0)], [np.zeros(0)]
    near = dt <= GAP * np.median(dt) if len(dt) else dt > 0.0
    for of_q, of_v in zip(q.T, v.T, strict=True):
        step, speed = of_q[k + 1] - of_q[k], 0.5 * (of_v[k + 1] + of_v[k])
        known = np.isfinite(step) & np.isfinite(speed)
        moves = near & (dt > 0.0) & known & (np.abs(speed) > STANDSTILL)
        if np.count_nonzero(moves) >= ENOUGH:
            way = speed[moves] * dt[moves]
            shares.append(step[moves] / way)
            ways.append(np.abs(way))
    return np.concatenate(shares), np.concatenate(ways)
