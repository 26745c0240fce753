"""A witness that knows nothing of our proofs: MuJoCo's contacts and inverse dynamics, at 5 kHz."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from urdyn.identify.excite import Path
from urdyn.model.arm import Arm
from urdyn.simulate.limits import Limits

RATE = 5000.0  # [Hz]


@dataclass(frozen=True)
class Violations:
    """Of one motion: how many moments, of how many."""

    moments: int
    contacts: int
    limits: int
    torques: int

    @property
    def none(self) -> bool:
        return not (self.contacts or self.limits or self.torques)


def watch(arm: Arm, path: Path, limits: Limits, duration: float) -> Violations:
    """What MuJoCo sees of the arm on a floor, all along a path, at RATE."""
    model = _model(arm)
    data = mujoco.MjData(model)
    t = np.arange(0.0, duration, 1.0 / RATE)
    q, v, a = path.at(t)
    contacts = torques = 0
    for k in range(len(t)):
        data.qpos[:] = q[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        contacts += data.ncon > 0
        if k % 10 == 0:
            data.qvel[:], data.qacc[:] = v[k], a[k]
            mujoco.mj_inverse(model, data)
            torques += bool((np.abs(data.qfrc_inverse) > limits.torque * (1.0 + 1e-9)).any())
    broken = (
        (np.abs(q - limits.middle) > limits.room)
        | (np.abs(v) > limits.velocity)
        | (np.abs(a) > limits.acceleration)
    )
    return Violations(len(t), contacts, int(broken.sum()), torques)


def _model(arm: Arm) -> mujoco.MjModel:
    """The URDF's own shapes, with a floor; parents and children may touch, no one else."""
    spec = mujoco.MjSpec.from_string(arm.urdf)
    floor = spec.worldbody.add_geom()
    floor.type, floor.size = mujoco.mjtGeom.mjGEOM_PLANE, [5.0, 5.0, 0.1]
    return spec.compile()
