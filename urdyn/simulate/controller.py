"""The position controller: feed-forward of a nominal model, and a feedback loop.

    tau = feedforward(target) + I (w² e + 2 w e' + w³/5 ∫e),    i = tau / K

The UR controller is not published. This one follows an excitation run to a few milliradians, keeps
torque limits, and rings when its gain or delay drifts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.types import Array

BANDWIDTH = 50.0  # [rad/s], low enough for elastic gears
INTEGRAL = 0.2  # [-] corner of the integral term, as a share of the bandwidth


@dataclass(frozen=True, eq=False)
class Controller:
    """Settings of the loop of every joint."""

    inertia: Array  # (J,) [kg·m²] for which the loop is tuned
    gain: Array  # (J,) [N·m/A] that the controller assumes of its drives
    limit: Array  # (J,) [N·m]
    bandwidth: float = BANDWIDTH  # [rad/s]

    def torque(self, ahead: Array, e: Array, de: Array, sum_e: Array, factor: Array) -> Array:
        """Requested torque, (J,) [N·m].

        Args:
            ahead: feed-forward torque (J,) [N·m].
            e: error of position (J,) [rad], `de` of velocity [rad/s], `sum_e` its integral [rad·s].
            factor: on the loop's gain, which may drift (J,) [-].
        """
        w = self.bandwidth
        loop = self.inertia * (w**2 * e + 2.0 * w * de + INTEGRAL * w**3 * sum_e)
        return np.clip(ahead + factor * loop, -self.limit, self.limit)


def typical_controller(dynamics: Dynamics) -> Controller:
    """A controller tuned to an arm as its maker knows it."""
    arm, drive = dynamics.arm, dynamics.drive
    stretched = np.zeros(arm.joints)
    mass = arm.torque_derivatives(stretched, stretched, stretched, dynamics.loaded())[2]
    return Controller(np.diag(mass) + drive.rotor_inertia, drive.gain, arm.effort_limit)
