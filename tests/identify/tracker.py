"""Sessions of a simulated tracker before an arm whose geometry is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.identify.kinematics.spread import geometry_spread
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.geometry.chain_pose import flange
from urdyn.model.geometry.drawing import drawing_of
from urdyn.model.geometry.turns import exponential
from urdyn.types import Array

# What d and theta of the first and the last joint do, base and tool do as well.
HIDDEN = (0, 1, 20, 21)


@dataclass(frozen=True)
class Session:
    """Poses and the truth behind them."""

    poses: Poses
    table: Array  # (6, 5) a ... theta
    deviations: Array  # (22,)
    base: Array  # (4, 4)
    tool: Array  # (4, 4)


def session(
    arm: Arm,
    rng: np.random.Generator,
    count: int,
    noise: float = 2e-5,
    q: Array | None = None,
    shift: Array | float = 0.0,
    own: bool = False,
    gross: int = 0,
    positions: bool = False,
    table: Array | None = None,
) -> Session:
    """`count` poses with noise [m, rad]; `shift` (count, 6) is added to the angles that act."""
    form = drawing_of(arm).form
    deviations = geometry_spread(form) * rng.standard_normal(int(form.free.sum()))
    table = form.table(deviations) if table is None else table
    q = rng.uniform(-2.8, 2.8, (count, 6)) if q is None else q
    base = np.eye(4) if own else exponential(rng.uniform(-2.0, 2.0, 6))
    tool = np.eye(4) if own else exponential(0.2 * rng.standard_normal(6))
    pose = base @ flange(table, q + shift) @ tool
    place = pose[:, :3, 3] + noise * rng.standard_normal((count, 3))
    wrong = rng.choice(count, gross, replace=False)
    place[wrong] += rng.uniform(0.02, 0.5, (gross, 3))
    jitter = Rotation.from_rotvec(noise * rng.standard_normal((count, 3))).as_matrix()
    turn = Rotation.from_matrix(jitter @ pose[:, :3, :3])
    angles = turn.as_rotvec() if own else turn.as_euler("XYZ")
    reading = "rotvec" if own else "XYZ"
    poses = Poses(q, place, None if positions else angles, reading, own)
    return Session(poses, table, (table - form.nominal)[form.free], base, tool)
