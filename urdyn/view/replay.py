"""A film of what was recorded: beliefs from a history, joint angles from the log that it is of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.errors import LogError
from urdyn.report.track.history import History
from urdyn.types import Array, Log
from urdyn.view.film import Film

RATE = 25.0  # [Hz] of a film, at most


def replay(run: History, log: Log, gain: Array | None) -> Film:
    """A tracked run.

    Args:
        log: that was tracked; a history holds no joint angles.
        gain: of the drives, (J,) [N·m/A]; None: residual torque is not known.
    """
    return replace(beliefs(run, gain), q=angles(log, run.column("t"), len(run.joints)))


def beliefs(run: History, gain: Array | None) -> Film:
    """A tracked run, whose joint angles are not known."""
    joints = range(len(run.joints))
    friction, health, zero = (_each(run, name) for name in ("friction", "health", "zero"))
    current, predicted = (
        np.stack([run.column(f"{what}_{j}") for j in joints], axis=1)
        for what in ("current", "predicted")
    )
    return Film(
        t=run.t,
        q=np.full_like(zero, np.nan),
        zero=zero,
        friction=share(friction, friction[0]),
        health=share(health, health[0]),
        torque=(current - predicted) * health * (np.nan if gain is None else gain),
    )


def motion(log: Log) -> Film:
    """A recording of which nothing is known but how the arm moved."""
    step = max(1, round(1.0 / (RATE * max(float(np.median(np.diff(log.t))), 1e-9))))
    stamps = log.t[::step]
    q = angles(log, stamps, log.joints)
    nothing = np.full_like(q, np.nan)
    return Film(stamps - stamps[0], q, np.zeros_like(q), nothing, nothing, nothing)


def angles(log: Log, stamps: Array, joints: int) -> Array:
    """Joint angles at `stamps`, (N, J) [rad]: between two rows, by linear interpolation."""
    path = log.source.path
    if "actual_q" not in log or log.joints != joints:
        raise LogError(f"has no angles of {joints} joints (actual_q); name another --log", path)
    if stamps[0] < log.t[0] - 1.0 or stamps[-1] > log.t[-1] + 1.0:
        raise LogError("does not span the tracked run; name the log that was tracked", path)
    q = log.channels["actual_q"]
    told = np.isfinite(q).all(axis=1)
    if not told.any():
        raise LogError("has no finite angle in it", path)
    return np.stack([np.interp(stamps, log.t[told], q[told, j]) for j in range(joints)], axis=1)


def share(now: Array, then: Array) -> Array:
    """Change in per cent."""
    return np.asarray(100.0 * (now / then - 1.0))


def _each(run: History, quantity: str) -> Array:
    """A quantity of every joint, (N, J)."""
    return np.stack([run.column(f"{joint}.{quantity}") for joint in run.joints], axis=1)
