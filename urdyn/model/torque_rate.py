"""Upper bound on the rate of torque: Newton and Euler with norms for vectors.

If w, alpha and eta bound a link's angular velocity, acceleration and jerk, a vector r that is
fixed in it has a second derivative below (alpha + w²) |r| and a third below
(eta + 3 alpha w + w³) |r|. Sums of such bounds along the chain hold in every pose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.errors import ArmError
from urdyn.model.arm import Arm
from urdyn.model.body import tensor
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class _Turning:
    """Bounds of one link, (N,) each: rotation and its frame's origin, to the third order."""

    w: Array  # [rad/s]
    alpha: Array  # [rad/s²]
    eta: Array  # [rad/s³]
    pull: Array  # [m/s²] of the origin, gravity with it
    jerk: Array  # [m/s³] of the origin

    @property
    def second(self) -> Array:
        """Second derivative of a unit vector in the link."""
        return self.alpha + self.w**2

    @property
    def third(self) -> Array:
        """Third derivative of a unit vector in the link."""
        return self.eta + 3.0 * self.alpha * self.w + self.w**3


def torque_rate(arm: Arm, v: Array, a: Array, jerk: Array) -> Array:
    """Bounds on |d torque / dt| (N, J) [N·m/s] from those on |v|, |a| and |jerk|, (N, J) each.

    Raises:
        ArmError: a joint slides, for which this does not hold.
    """
    model = arm._model
    if arm.slides.any():
        raise ArmError(f"{arm.name} has a joint that slides; torque is bounded of turning joints")
    lengths = [float(np.linalg.norm(place.translation)) for place in list(model.jointPlacements)]
    links = _along(v, a, jerk, np.array(lengths[1:]), float(np.linalg.norm(model.gravity.linear)))
    out = np.empty(v.shape)
    moment, change = np.zeros(len(v)), np.zeros(len(v))
    force, force_change = np.zeros(len(v)), np.zeros(len(v))
    for k in range(arm.joints - 1, -1, -1):
        here, body = links[k], arm.inertials[k]
        if k + 1 < arm.joints:  # load of the next joint, at a lever arm of this link
            r = lengths[k + 2]
            change = change + r * (force_change + here.w * force)
            moment = moment + r * force
        own, own_change = _weight(here, body)
        moment, change = moment + own[1], change + own_change[1]
        force, force_change = force + own[0], force_change + own_change[0]
        turning = links[k - 1].w if k else np.zeros(len(v))
        out[:, k] = change + turning * moment
    return out


def _along(v: Array, a: Array, jerk: Array, lengths: Array, gravity: float) -> list[_Turning]:
    """Bounds link by link, from a base that stands still."""
    zero = np.zeros(len(v))
    before, links = _Turning(zero, zero, zero, zero + gravity, zero), []
    for k, length in enumerate(lengths):
        speed, accel, change = np.abs(v[:, k]), np.abs(a[:, k]), np.abs(jerk[:, k])
        before = _Turning(
            before.w + speed,
            before.alpha + accel + before.w * speed,
            before.eta + change + 2.0 * accel * before.w + speed * before.second,
            before.pull + length * before.second,
            before.jerk + length * before.third,
        )
        links.append(before)
    return links


def _weight(link: _Turning, body: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Force and moment about the link's origin, and their rates."""
    mass, first = float(body[0]), float(np.linalg.norm(body[1:4]))
    inertia = float(np.abs(np.linalg.eigvalsh(tensor(body[4:]))).max())
    force = mass * link.pull + first * link.second
    moment = inertia * link.second + first * link.pull
    turned = link.eta + 4.0 * link.alpha * link.w + link.w**3
    return (force, moment), (
        mass * link.jerk + first * link.third,
        inertia * turned + first * (link.jerk + link.w * link.pull),
    )
