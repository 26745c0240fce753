"""The open-loop arm: it follows a trajectory exactly, and its drives give what that takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import bristles
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.types import Array


def current(dynamics: Dynamics, trajectory: Trajectory, t: Array, temperature: float) -> Array:
    """Motor current at times (N,) [s], (N, J) [A]; friction at rest is zero before the first.

    Args:
        temperature: of all joints [°C].
    """
    drive, amperes, end = dynamics.drive, np.empty((len(t), trajectory.joints)), None
    for rows in blocks(len(t)):
        # One row of the block before, because travel counts from there.
        motion = trajectory.at(t[max(rows.start - 1, 0) : rows.stop])
        motion = replace(motion, temperature=np.broadcast_to(temperature, motion.q.shape))
        moved = bristles(motion, drive.presliding_distance, end)
        end, s = moved.end, moved.together(drive.presliding_tail)
        torque = dynamics.torque(motion, s)[-(rows.stop - rows.start) :]
        amperes[rows] = torque / (drive.gain * drive.health)
    return amperes


def blockwise(values: Callable[[Array], Array], t: Array, width: int) -> Array:
    """`values` (M, width) of the times (M,), for all times block by block, (N, width)."""
    whole = np.empty((len(t), width))
    for rows in blocks(len(t)):
        whole[rows] = values(t[rows])
    return whole
