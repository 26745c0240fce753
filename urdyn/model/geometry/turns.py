"""Elementary motions, and poses as vectors."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.types import Array


def turn_z(angle: Array | float) -> Array:
    """Rotations about z by `angle` (...) [rad], as poses (..., 4, 4)."""
    pose = np.zeros((*np.shape(angle), 4, 4))
    pose[..., 0, 0] = pose[..., 1, 1] = np.cos(angle)
    pose[..., 1, 0] = np.sin(angle)
    pose[..., 0, 1] = -pose[..., 1, 0]
    pose[..., 2, 2] = pose[..., 3, 3] = 1.0
    return pose


def places_of(table: Array) -> Array:
    """Tx(a) Rx(alpha) Ry(beta) Tz(d) Rz(theta), (J, 4, 4) of rows (J, 5)."""
    a, alpha, beta, d, theta = table.T
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    ct, st = np.cos(theta), np.sin(theta)
    x = np.stack([cb * ct, ca * st + sa * sb * ct, sa * st - ca * sb * ct], axis=1)
    y = np.stack([-cb * st, ca * ct - sa * sb * st, sa * ct + ca * sb * st], axis=1)
    z = np.stack([sb, -sa * cb, ca * cb], axis=1)
    place = d[:, None] * z
    place[:, 0] += a
    return pose_of(place, np.stack([x, y, z], axis=2))


def pose_of(place: Array, turn: Array) -> Array:
    """Poses (..., 4, 4) from positions (..., 3) [m] and rotations (..., 3, 3)."""
    pose = np.zeros((*np.shape(place)[:-1], 4, 4))
    pose[..., :3, :3] = turn
    pose[..., :3, 3] = place
    pose[..., 3, 3] = 1.0
    return pose


def inverse(pose: Array) -> Array:
    """The inverse of poses (..., 4, 4)."""
    back = np.swapaxes(pose[..., :3, :3], -1, -2)
    return pose_of(-np.einsum("...ij,...j->...i", back, pose[..., :3, 3]), back)


def exponential(vector: Array) -> Array:
    """The pose (4, 4) of a translation and a rotation vector (6,) [m, rad]."""
    return pose_of(vector[:3], Rotation.from_rotvec(vector[3:]).as_matrix())


def rotation_vector(turn: Array) -> Array:
    """Rotation vectors (..., 3) [rad] of matrices (..., 3, 3)."""
    flat = Rotation.from_matrix(np.reshape(turn, (-1, 3, 3))).as_rotvec()
    return np.asarray(flat.reshape(*np.shape(turn)[:-2], 3))
