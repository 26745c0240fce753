"""Where the last frame of a chain is, and how it moves with every coordinate of the geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.model.geometry.turns import places_of, turn_z
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Reach:
    """Poses of the last joint's frame in the base, and the twists that move it.

    A twist is the velocity of the frame's origin and the angular velocity, in the base's axes, for
    a unit of speed of a coordinate.
    """

    pose: Array  # (N, 4, 4) transform_flange_to_base
    twists: Array  # (N, 6, J, 5) of a, alpha, beta, d, theta of each joint [m, rad]


def flange(table: Array, q: Array) -> Array:
    """transform_flange_to_base (N, 4, 4) of an arm with a ... theta `table` (J, 5) at q (N, J)."""
    pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for origin, angle in zip(places_of(table), q.T, strict=True):
        pose = pose @ (origin @ turn_z(angle))
    return pose


def reach(table: Array, q: Array) -> Reach:
    """Pose and twists of an arm with a ... theta `table` (J, 5) at joint angles q (N, J)."""
    pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    axes = np.empty((len(q), 5, len(table), 3))
    points = np.empty_like(axes)
    for j, row in enumerate(table):
        origin, middle = places_of(row[None])[0], pose[:, :3, 3] + row[0] * pose[:, :3, 0]
        ahead = pose @ origin
        rolled = np.array([0.0, np.cos(row[1]), np.sin(row[1])])
        axes[:, 0, j] = axes[:, 1, j] = pose[:, :3, 0]
        axes[:, 2, j] = pose[:, :3, :3] @ rolled
        axes[:, 3, j] = axes[:, 4, j] = ahead[:, :3, 2]
        points[:, :3, j], points[:, 3:, j] = middle[:, None], ahead[:, None, :3, 3]
        pose = ahead @ turn_z(q[:, j])
    linear = np.cross(axes, pose[:, None, None, :3, 3] - points)
    linear[:, (0, 3)] = axes[:, (0, 3)]
    angular = np.array(axes)
    angular[:, (0, 3)] = 0.0
    return Reach(pose, np.concatenate([linear, angular], axis=3).transpose(0, 3, 2, 1))
