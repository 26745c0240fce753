"""The tool pose that the controller reports."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.arm import Arm, controller_base
from urdyn.simulate.trajectory import blocks
from urdyn.types import Array


def tool_pose(arm: Arm, q: Array) -> Array:
    """Place [m] and rotation vector [rad] of the tool, (N, 6), in the controller's base frame."""
    from_root = np.linalg.inv(controller_base(arm))
    return np.concatenate([_pose(from_root @ arm.pose(q[b])) for b in blocks(len(q))])


def _pose(transform: Array) -> Array:
    turned = Rotation.from_matrix(transform[:, :3, :3]).as_rotvec()
    return np.hstack([transform[:, :3, 3], turned])
