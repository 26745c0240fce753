"""Every unknown's contribution to every joint's torque, and its gradient in the motion.

    tau_j(t) = phi_j(q, v, a) w_j,    phi_j = [Y_j(q, v, a), drive terms]

Presliding is smoothed, s = tanh(v / SLIDING): motions last seconds, and its derivative is needed.
The shape of presliding, ripple and temperature are left out: no design depends on them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, fading, feature
from urdyn.types import Array

FRICTION = ("coulomb", "viscous", "structural", "offset", "stribeck")
TERMS = ("rotor_inertia", *FRICTION)
SLIDING = 0.1  # [rad/s] over which friction reverses: joints move ten times as fast
NUDGE = 1e-6  # [rad, rad/s] step of finite differences; the regressor is linear in acceleration


@dataclass(frozen=True, eq=False)
class Columns:
    """The columns at N moments of a motion."""

    phi: Array  # (N, J, 10 J + len(TERMS))
    load: Array  # (N, J) [N·m] rigid-body torque
    point: Dynamics
    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    a: Array  # (N, J) [rad/s²]

    def slopes(self, of_phi: Array, of_load: Array) -> tuple[Array, Array, Array]:
        """d/dq, d/dv, d/da (N, J) each, of sum of_phi · phi + sum of_load · load."""
        rigid = of_phi.shape[2] - len(TERMS)
        rotor, coulomb, viscous, structural, _, stribeck = np.moveaxis(of_phi[:, :, rigid:], 2, 0)
        s, slope = _sliding(self.v)
        left, speed = fading(self.v, self.point.drive), self.point.drive.stribeck_velocity
        # Structural damping is a regressor through the load.
        on_load = of_load + structural * s * np.sign(self.load)
        pi = self.point.loaded().ravel()
        dq, dv, da = self._rigid(of_phi[:, :, :rigid] + on_load[:, :, None] * pi)
        dv += (coulomb + structural * np.abs(self.load) + stribeck * left) * slope
        dv += viscous - stribeck * left * s * np.sign(self.v) / speed
        return dq, dv, da + rotor

    def _rigid(self, weights: Array) -> tuple[Array, Array, Array]:
        """Gradients of sum weights · Y, weights (N, J, 10 J), by one-sided differences."""
        arm, joints = self.point.arm, self.q.shape[1]
        now = self.phi[:, :, : 10 * joints]
        out = np.empty((3, len(self.q), joints))
        for order, step in enumerate((NUDGE, NUDGE, 1.0)):
            for j in range(joints):
                moved = [self.q, self.v, self.a]
                moved[order] = moved[order] + step * np.eye(joints)[j]
                change = (arm.regressor(*moved) - now) / step
                out[order, :, j] = np.einsum("njc,njc->n", change, weights)
        return out[0], out[1], out[2]


def columns(point: Dynamics, q: Array, v: Array, a: Array) -> Columns:
    """Columns at N moments (N, J) of a motion of an arm like `point`, with its load."""
    rigid = point.arm.regressor(q, v, a)
    load = rigid @ point.loaded().ravel()
    at = Contact(q, v, np.full_like(v, np.nan), load, _sliding(v)[0])
    friction = [feature(name, at, point.drive) for name in FRICTION]
    terms = np.stack([a, *friction], axis=2)
    return Columns(np.concatenate([rigid, terms], axis=2), load, point, q, v, a)


def _sliding(v: Array) -> tuple[Array, Array]:
    """Presliding state and its derivative in velocity."""
    s = np.tanh(v / SLIDING)
    return s, (1.0 - s * s) / SLIDING
