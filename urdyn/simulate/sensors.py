"""Errors of a controller's sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.model.population import TEMPERATURE, population
from urdyn.simulate.noise import Band
from urdyn.simulate.trajectory import Trajectory
from urdyn.types import Array, freeze

# Noise of measured current over the current of Coulomb friction, by joint: on recordings of a
# UR10e .23 .25 .14 .036 .052 .036 A remain with any model.
NOISE_SHARE = (0.166, 0.181, 0.222, 0.124, 0.179, 0.124)
ENCODER_STEP = 2.0 * np.pi / 2**19  # [rad]: angles of a UR5e differ by 1.2e-5 rad or multiples
VELOCITY_NOISE = 2e-3  # [rad/s], on recordings of a UR10e
TEMPERATURE_STEP = 1.0 / 16.0  # [K], in recordings of a UR3 and a UR3e

# Colour of that noise, (time [s], frequency [Hz]) -> share of the variance by joint. Residuals of a
# model fitted to one UR10e excitation, on three others (118 s in motion at 8 to 14 ms, clipped at
# five sigma): least squares of their autocorrelation up to .6 s, by true time, common times and
# frequency. Slow: what the model leaves; the others: filter of the current, structure of the arm.
# An AR model of order 8 is no closer, and would hold at one rate only.
COLOUR = {
    (0.010, 0.0): (0.00, 0.43, 0.50, 0.42, 0.28, 0.09),
    (0.025, 26.7): (0.35, 0.23, 0.32, 0.37, 0.16, 0.07),
    (1.2, 0.0): (0.24, 0.09, 0.11, 0.14, 0.19, 0.07),
}
FORCE_NOISE, MOMENT_NOISE = 1.0, 0.02  # [N], [N·m]: between rows of a recording of a UR3e


@dataclass(frozen=True, eq=False)
class Sensors:
    """The errors with which a motion is observed."""

    current_noise: Array  # (J,) [A] sd
    colour: float = 0.0  # [-] AR(1) coefficient of that noise, per row, in [0, 1)
    encoder_step: float = ENCODER_STEP  # [rad] at the joint; 0: none
    velocity_noise: float = VELOCITY_NOISE  # [rad/s] sd while moving
    temperature: float = TEMPERATURE  # [°C] of all joints, without heat
    cycle: float = 0.002  # [s] of the controller; stamps are multiples of it
    bands: tuple[Band, ...] = ()  # colour of the current's noise in continuous time
    temperature_step: float = 0.0  # [K]; 0: none
    wrench_noise: tuple[float, float] | None = None  # [N], [N·m] sd; None: no wrench is reported

    def __post_init__(self) -> None:
        freeze(self, "current_noise")
        if not 0.0 <= self.colour < 1.0:
            raise InputError(f"colour {self.colour}: from 0 to below 1")
        if self.colour and self.bands:
            raise InputError("noise has a colour by its rows or by its bands, not by both")

    def stamps(self, trajectory: Trajectory) -> Array:
        """Controller cycles closest to the trajectory's rows, (N,) [s]."""
        if trajectory.step < self.cycle * (1.0 - 1e-9):
            most, asked = 1.0 / self.cycle, 1.0 / trajectory.step
            raise InputError(f"the controller reports at {most:g} Hz; {asked:g} Hz is too much")
        cycles = np.round(trajectory.t / self.cycle)
        return np.round(cycles * self.cycle, 9)  # .694, not .6940000000000001


def typical_sensors(arm: Arm) -> Sensors:
    """Sensors as on recordings of real arms, scaled to this one, with white noise."""
    drive = population(arm).typical().drive
    return Sensors(_by_joint(arm, NOISE_SHARE) * drive.coulomb / drive.gain)


def real_sensors(arm: Arm) -> Sensors:
    """The same with everything that recordings show: colour, steps of temperature, the wrench."""
    return replace(
        typical_sensors(arm),
        bands=tuple(
            Band(time, _by_joint(arm, share), frequency)
            for (time, frequency), share in COLOUR.items()
        ),
        temperature_step=TEMPERATURE_STEP,
        wrench_noise=(FORCE_NOISE, MOMENT_NOISE),
    )


def perfect_sensors(arm: Arm) -> Sensors:
    """Sensors without errors."""
    return Sensors(np.zeros(arm.joints), encoder_step=0.0, velocity_noise=0.0)


def _by_joint(arm: Arm, values: tuple[float, ...]) -> Array:
    """Values for a six-joint arm; for others, their median at every joint."""
    same = np.array(values)
    return same if arm.joints == len(same) else np.full(arm.joints, np.median(same))
