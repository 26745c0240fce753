"""Limits of an arm's motion: angle, speed, acceleration and torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.types import Array, freeze

ACCELERATION = np.radians(800.0)  # [rad/s²] of every joint, as in UR's own planner configuration

ROUNDING = 1e-9  # [-] by which a motion scaled to a limit may exceed it

# An excitation keeps away from the limits.
EXCURSION = 1.5  # [rad] to either side of the middle: far, but without hitting the floor or itself
GENTLE_ACCELERATION = 4.0  # [rad/s²]
SHARE_OF_RANGE, SHARE_OF_VELOCITY, SHARE_OF_EFFORT = 0.95, 0.9, 0.8  # [-]

# Angles at which a UR arm's joints are upright [rad]; other joints move about the middle of their
# range, and these as near to upright as their range allows.
UPRIGHT = {"shoulder_lift_joint": -np.pi / 2, "wrist_1_joint": -np.pi / 2}


@dataclass(frozen=True, eq=False)
class Limits:
    """Largest values that a motion may have, each (J,)."""

    lower: Array  # [rad]
    upper: Array  # [rad]
    velocity: Array  # [rad/s]
    acceleration: Array  # [rad/s²]
    torque: Array  # [N·m], of rigid bodies

    def __post_init__(self) -> None:
        freeze(self, "lower", "upper", "velocity", "acceleration", "torque")

    @property
    def middle(self) -> Array:
        """Pose in the middle, (J,) [rad]."""
        return 0.5 * (self.lower + self.upper)

    @property
    def room(self) -> Array:
        """Distance from the middle to either end, (J,) [rad]."""
        return 0.5 * (self.upper - self.lower)

    def shares(self, arm: Arm, q: Array, v: Array, a: Array) -> dict[str, Array]:
        """Share of each limit that every row of a motion uses, (N, J) [-]; 1: it is reached."""
        return {
            "angle": np.abs(q - self.middle) / self.room,
            "velocity": np.abs(v) / self.velocity,
            "acceleration": np.abs(a) / self.acceleration,
            "torque": np.abs(arm.torque(q, v, a)) / self.torque,
        }

    def hold(self, arm: Arm, q: Array, v: Array, a: Array) -> bool:
        """Does the motion stay within every limit?"""
        return all(bool(np.all(x <= 1.0 + ROUNDING)) for x in self.shares(arm, q, v, a).values())


def rated(arm: Arm) -> Limits:
    """What the maker allows."""
    acceleration = np.full(arm.joints, ACCELERATION)
    return Limits(arm.lower, arm.upper, arm.velocity_limit, acceleration, arm.effort_limit)


def comfortable(
    arm: Arm,
    excursion: float = EXCURSION,
    velocity: float = SHARE_OF_VELOCITY,
    acceleration: float = GENTLE_ACCELERATION,
) -> Limits:
    """Limits of an excitation: about the upright pose, well below what the maker allows.

    Args:
        excursion: to either side of the middle [rad], where there is room.
        velocity: share of the largest velocity [-].
        acceleration: of every joint [rad/s²].
    """
    middle = 0.5 * (arm.lower + arm.upper)
    names = [name.removeprefix(arm.prefix) for name in arm.joint_names]
    wished = [UPRIGHT.get(name, m) for name, m in zip(names, middle, strict=True)]
    swing = np.minimum(EXCURSION / SHARE_OF_RANGE, 0.5 * (arm.upper - arm.lower))
    middle = np.clip(wished, arm.lower + swing, arm.upper - swing)
    room = SHARE_OF_RANGE * np.minimum(middle - arm.lower, arm.upper - middle)
    reach = np.minimum(excursion, room)
    return Limits(
        lower=middle - reach,
        upper=middle + reach,
        velocity=velocity * arm.velocity_limit,
        acceleration=np.full(arm.joints, acceleration),
        torque=SHARE_OF_EFFORT * arm.effort_limit,
    )


def require(arm: Arm, limits: Limits, trajectory: Trajectory, name: str = "trajectory") -> None:
    """InputError if the trajectory exceeds a limit: which joint, which limit, and when."""
    for rows in blocks(len(trajectory)):
        motion = (trajectory.q[rows], trajectory.v[rows], trajectory.a[rows])
        for what, share in limits.shares(arm, *motion).items():
            row, joint = np.unravel_index(np.argmax(share), share.shape)
            if not share[row, joint] <= 1.0 + ROUNDING:
                who, much = arm.joint_names[joint], 100.0 * share[row, joint]
                when = float(trajectory.t[rows][row])
                remedy = "keep within its range" if what == "angle" else "slow it down"
                raise InputError(
                    f"{name}: {who} at {much:.0f} % of its {what} limit at {when:.3f} s: {remedy}"
                )
