"""Heat: a joint warms by its own losses, its lubricant follows, and viscous friction falls.

C dT/dt = P - (T - T_room) / R        P = P_idle + friction torque v + R_copper i²
lag dL/dt = T - L
viscous friction at L = alpha exp(-kappa (L - T_ref))
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import WORKING_SPEED
from urdyn.model.population import population
from urdyn.types import Array, freeze

STEP = 1.0  # [s] step of the thermal model, whose changes are slow

# A UR3 in production warms by 7 to 11 K in 50 minutes, with a time constant of 25 to 30 minutes,
# from 28 to 32 °C, warm from its electronics; joints of a UR3e are at 34 to 43 °C at work.
TIME_CONSTANT = 1800.0  # [s], R C
LUBRICANT_LAG = 300.0  # [s]
AMBIENT = 22.0  # [°C]
IDLE_RISE = 6.0  # [K] due to electronics alone
WORKING_RISE = 9.0  # [K] due to a typical joint's friction at WORKING_SPEED
KAPPA = 0.014  # [1/K]: friction of UR arms falls by 15 to 25 % from cold to warm, over 12 to 20 K
# From voltage and current in UR's joint test of a UR5e; a stronger motor has thicker wire.
COPPER, COPPER_TORQUE = 0.17, 150.0  # [Ohm], [N·m] rating of its joint


@dataclass(frozen=True, eq=False)
class Heat:
    """Thermal model of an arm's joints, one entry per joint."""

    resistance: Array  # (J,) [K/W], R
    kappa: Array  # (J,) [1/K]
    copper: Array  # (J,) [Ohm]
    time_constant: float = TIME_CONSTANT  # [s]
    lag: float = LUBRICANT_LAG  # [s]
    ambient: float = AMBIENT  # [°C] of the room initially, and of an arm that was switched off

    def __post_init__(self) -> None:
        freeze(self, "resistance", "kappa", "copper")

    @property
    def cold(self) -> Array:
        """Joints and lubricant of an arm that was just switched on, (2, J) [°C]."""
        return np.full((2, len(self.kappa)), self.ambient)

    def follow(self, power: Array, ambient: Array, start: Array) -> Array:
        """Joints and lubricant at the end of each STEP, (2, M, J) [°C].

        Exact for joints with steady power; the lubricant follows the joint's temperature at the
        step's end, and so is half a step early.

        Args:
            power: mean loss of each step, (M, J) [W].
            ambient: of each step, (M,) [°C].
            start: before the first, (2, J) [°C].
        """
        settled = ambient[:, None] + self.resistance * power
        joints = _lagging(settled, self.time_constant, start[0])
        return np.stack([joints, _lagging(joints, self.lag, start[1])])

    def softening(self, lubricant: Array, reference: Array) -> Array:
        """Viscous friction over that at the reference temperature, (..., J) [-]."""
        return np.asarray(np.exp(-self.kappa * (lubricant - reference)))


def typical_heat(dynamics: Dynamics) -> Heat:
    """Heat as in real arms: a larger joint generates and dissipates more.

    A drive with its own thermal coefficient uses that instead of kappa.
    """
    arm, drive = dynamics.arm, population(dynamics.arm).typical().drive
    working = (drive.coulomb + drive.viscous * WORKING_SPEED) * WORKING_SPEED
    rated = np.isfinite(arm.effort_limit) & (arm.effort_limit > 0.0)
    return Heat(
        resistance=WORKING_RISE / working,
        kappa=np.where(dynamics.drive.thermal, 0.0, KAPPA),
        copper=COPPER * COPPER_TORQUE / np.where(rated, arm.effort_limit, COPPER_TORQUE),
    )


def _lagging(wanted: Array, time_constant: float, start: Array) -> Array:
    """First-order lag toward the target of each step, (M, J)."""
    keep = np.exp(-STEP / time_constant)
    lagging, _ = lfilter([1.0 - keep], [1.0, -keep], wanted, axis=0, zi=keep * start[None])
    return np.asarray(lagging)
