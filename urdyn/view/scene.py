"""Where everything stands: links by the arm's kinematics, ghosts, and arrows at the joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.arm import Arm
from urdyn.types import Array
from urdyn.view.shapes import Shape

STRIDE = 0.08  # [m] from a joint to where its arrow begins, clear of the link's shell


@dataclass(frozen=True, eq=False)
class Scene:
    """An arm as it is, and by its nominal description."""

    arm: Arm  # calibrated, if it was
    nominal: Arm
    shapes: tuple[Shape, ...]

    @property
    def calibrated(self) -> bool:
        """Whether the arm is known to differ from its nominal description."""
        return self.arm is not self.nominal

    def places(self, q: Array, zero: Array) -> Array:
        """transform_link_to_base of every shape, (S, 4, 4).

        Args:
            q: angles by the encoders, (J,) [rad].
            zero: by which the joints are off them, (J,) [rad].
        """
        return np.stack([self.arm.pose(q + zero, shape.link) for shape in self.shapes])

    def ghosts(self, q: Array, zero: Array, times: float) -> Array:
        """The same of the nominal arm, (S, 4, 4), standing `times` as far off as it is."""
        solid = self.places(q, zero)
        nominal = np.stack([self.nominal.pose(q, shape.link) for shape in self.shapes])
        return np.stack([further(a, b, times) for a, b in zip(solid, nominal, strict=True)])

    def apart(self, q: Array, zero: Array) -> tuple[float, float]:
        """How far the tool is from where the nominal arm has it: [m] and [rad]."""
        tool, nominal = self.arm.pose(q + zero), self.nominal.pose(q)
        turn = Rotation.from_matrix(tool[:3, :3].T @ nominal[:3, :3]).magnitude()
        return float(np.linalg.norm(nominal[:3, 3] - tool[:3, 3])), float(turn)

    def arrows(self, q: Array, zero: Array, torque: Array, length: float) -> Array:
        """Start and end of an arrow per joint along its axis, right-handed, (J, 2, 3) [m].

        Args:
            torque: (J,) [N·m]; NaN: none.
            length: of an arrow [m/(N·m)].
        """
        at = q + zero
        axes = self.arm.jacobian(at)[3:].T
        origin = np.stack([self.arm.pose(at, link)[:3, 3] for link in self.arm.link_names])
        told = np.nan_to_num(torque)
        start = origin + STRIDE * np.where(told < 0.0, -1.0, 1.0)[:, None] * axes
        return np.stack([start, start + length * told[:, None] * axes], axis=1)


def further(solid: Array, ghost: Array, times: float) -> Array:
    """A pose `times` as far from `solid` (4, 4) as `ghost` is, in position and in rotation."""
    turn = Rotation.from_matrix(solid[:3, :3].T @ ghost[:3, :3]).as_rotvec()
    moved = np.eye(4)
    moved[:3, :3] = solid[:3, :3] @ Rotation.from_rotvec(times * turn).as_matrix()
    moved[:3, 3] = solid[:3, 3] + times * (ghost[:3, 3] - solid[:3, 3])
    return moved


def quaternion(pose: Array) -> tuple[float, float, float, float]:
    """w, x, y, z of a pose (4, 4)."""
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return float(w), float(x), float(y), float(z)
