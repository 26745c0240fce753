"""The wrench at the flange, due to payload and pushes on the last link.

    f = m a + alpha x h + w x (w x h)        h = m c
    n = I alpha + w x I w + h x a            all about the last joint's frame, in its axes

with gravity as an acceleration upward.
"""

from __future__ import annotations

import re

import numpy as np

from urdyn.model.arm import Arm, controller_base
from urdyn.model.dynamics import Dynamics
from urdyn.model.ur_type import ur_type
from urdyn.simulate.schedule import Course
from urdyn.types import Array, Motion

GRAVITY = np.array([0.0, 0.0, -9.81])  # [m/s²] in the root's axes
APART = 1e-5  # [s] step for the Jacobian's time derivative
SENSING = re.compile(r"ur(\d+e|15|20|30)")  # arms with a force sensor at the flange
TENSOR = np.array([[4, 5, 7], [5, 6, 8], [7, 8, 9]])  # of inertials, in Pinocchio's order


def has_force_sensor(arm: Arm) -> bool:
    """Whether there is a sensor at the flange, as from the e-Series on."""
    return SENSING.fullmatch(ur_type(arm)) is not None


def wrenches(dynamics: Dynamics, course: Course, motion: Motion) -> dict[str, Array]:
    """Force and moment that act on the flange, (N, 6) each [N, N·m], by their RTDE names.

    `ft_raw_wrench` is all that the sensor feels, in the flange's axes. `actual_TCP_force` is in the
    base's, without the wrench of the payload known to the controller, that of the first day.
    """
    arm, link = dynamics.arm, dynamics.arm.link_names[-1]
    turn = arm.pose(motion.q, link)[:, :3, :3]
    twist, acceleration = flange_motion(arm, motion)
    flange_to_base = controller_base(arm)[:3, :3].T @ turn
    push = into(flange_to_base, course.push[:, -1])
    w, alpha = into(turn, twist)[:, 3:], into(turn, acceleration)[:, 3:]
    a = np.einsum("nji,nj->ni", turn, acceleration[:, :3] - GRAVITY)
    unknown = push - carrying(course.payload - dynamics.payload, a, w, alpha)
    return {
        "ft_raw_wrench": push - carrying(course.payload, a, w, alpha),
        "actual_TCP_force": into(np.swapaxes(flange_to_base, 1, 2), unknown),
    }


def carrying(body: Array, a: Array, w: Array, alpha: Array) -> Array:
    """Wrench (N, 6) needed to move bodies (N, 10) like this, all in the axes of their frame."""
    m, h, inertia = body[:, :1], body[:, 1:4], body[:, TENSOR]

    def of(vector: Array) -> Array:
        return np.asarray(np.einsum("nij,nj->ni", inertia, vector))

    force = m * a + np.cross(alpha, h) + np.cross(w, np.cross(w, h))
    moment = of(alpha) + np.cross(w, of(w)) + np.cross(h, a)
    return np.hstack([force, moment])


def flange_motion(arm: Arm, motion: Motion) -> tuple[Array, Array]:
    """Twist of the last link and its derivative, (N, 6) each, linear first, in the root's axes."""
    link = arm.link_names[-1]
    now, later, before = (arm.jacobian(motion.q + h * motion.v, link) for h in (0.0, APART, -APART))
    bending = (later - before) / (2.0 * APART)
    twist = np.einsum("nij,nj->ni", now, motion.v)
    return twist, np.einsum("nij,nj->ni", now, motion.a) + np.einsum(
        "nij,nj->ni", bending, motion.v
    )


def into(turn: Array, wrench: Array) -> Array:
    """Force and moment (N, 6) in the frame whose axes are `turn` (N, 3, 3) in the present frame."""
    return np.hstack([np.einsum("nji,nj->ni", turn, half) for half in np.hsplit(wrench, 2)])
