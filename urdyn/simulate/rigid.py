"""The torque that gears transmit, with changing payloads and pushes on links.

tau_load = RNEA(q, v, a; links and payload) - sum over links of J' F
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.model.arm import Arm, controller_base
from urdyn.model.dynamics import Dynamics
from urdyn.simulate.schedule import Course
from urdyn.types import Array, Motion


def transmitted(dynamics: Dynamics, course: Course, motion: Motion) -> Array:
    """Rigid-body torque along a motion at the times of its course, (N, J) [N·m]."""
    load = _carrying(dynamics, course.payload, motion)
    felt = course.push.any(axis=(1, 2))
    if felt.any():
        load[felt] -= pushed(dynamics.arm, motion.q[felt], course.push[felt])
    return load


def pushed(arm: Arm, q: Array, push: Array) -> Array:
    """Joint torques (N, J) due to pushes on the links (N, J, 6): sum of J' F.

    F is in the axes of the controller's base, J in those of the root, of the middle of the link:
    where two links meet, no torque would tell which of them it was.
    """
    torque = np.zeros(q.shape)
    root_to_base = np.kron(np.eye(2), controller_base(arm)[:3, :3].T)
    for link in np.flatnonzero(push.any(axis=(0, 2))):
        ends = (*arm.link_names, arm.tool)[link : link + 2]
        middle = np.mean([arm.jacobian(q, end) for end in ends], axis=0)
        own = middle[..., : link + 1]  # the next joint moves no point of this link
        torque[:, : link + 1] += np.einsum("nij,ni->nj", own, push[:, link] @ root_to_base)
    return torque


def _carrying(dynamics: Dynamics, payload: Array, motion: Motion) -> Array:
    """Torque with each row's payload (N, 10), payload by payload, as they are few."""
    if (payload == payload[0]).all():
        return replace(dynamics, payload=payload[0]).load(motion)
    kinds, which = np.unique(payload, axis=0, return_inverse=True)
    load = np.empty(motion.q.shape)
    for k, kind in enumerate(kinds):
        rows = which.ravel() == k
        inertials = replace(dynamics, payload=kind).loaded()
        q, v, a = motion.q[rows], motion.v[rows], motion.a[rows]
        load[rows] = dynamics.arm.torque(q, v, a, inertials)
    return load
