"""Runs of the real UR10e, and what is put into a run's currents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, features
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Log, Motion

COLUMNS = "timestamp,actual_q*6,actual_qd*6,actual_current*6,target_current*6,target_moment*6"
SLIDES = 0.01  # [rad/s]

Recorded = Callable[..., Log]


def worn(
    log: Log, arm: Dynamics, joint: int, more: float | np.ndarray, since: float = -np.inf
) -> Log:
    """The log with so much more of a joint's friction in its current, from a stamp [s] on.

    Args:
        more: of it [-]; (N,) where that changes.
    """
    drive, v = arm.drive, log.joint("actual_qd")[:, joint]
    lost = drive.coulomb[joint] * np.tanh(v / SLIDES) + drive.viscous[joint] * v
    current = log.joint("actual_current").copy()
    current[:, joint] += (log.t >= since) * more * lost / drive.gain[joint]
    return with_current(log, current)


def grown(
    motion: Motion, arm: Dynamics, joint: int, coulomb: float, viscous: float, since: float
) -> float:
    """By how much all friction of a joint grows where two of its terms do [-].

    Args:
        since: stamp from which on the motion counts [s].
    """
    q, v, a = motion.q, motion.v, motion.a
    load = arm.arm.regressor(q, v, a) @ arm.loaded().ravel()
    terms = features(Contact(q, v, motion.temperature, load, arm.presliding(motion)), arm.drive)
    slides = (np.abs(v[:, joint]) > STANDING) & (motion.t >= since)
    way = np.where(slides, np.sign(v[:, joint]), 0.0)
    torque = {
        name: float(way @ (getattr(arm.drive, name) * terms[name])[:, joint])
        for name in ("coulomb", "viscous", "structural", "stribeck")
    }
    more = coulomb * torque["coulomb"] + viscous * torque["viscous"]
    return more / sum(torque.values())


def with_current(log: Log, current: np.ndarray) -> Log:
    """The log with other currents, (N, J) [A]."""
    return replace(log, channels={**log.channels, "actual_current": current})
