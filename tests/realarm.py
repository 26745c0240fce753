"""Runs of the real UR10e, and what is put into a run's currents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.types import Log

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


def with_current(log: Log, current: np.ndarray) -> Log:
    """The log with other currents, (N, J) [A]."""
    return replace(log, channels={**log.channels, "actual_current": current})
