"""What a controller reports of a motion: RTDE's columns, with the noise that real ones have."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import TEMPERATURE, population
from urdyn.simulate.follow import blockwise, current
from urdyn.simulate.tool import tool_pose
from urdyn.simulate.trajectory import Trajectory
from urdyn.types import Array, Log, frozen

# Noise of measured current over the current of Coulomb friction, by joint: .23 .25 .14 .036 .052
# .036 A are left on recordings of a UR10e whatever model is fitted.
NOISE_SHARE = (0.20, 0.22, 0.25, 0.13, 0.19, 0.13)
ENCODER_STEP = 2.0 * np.pi / 2**19  # [rad]: angles of a UR5e differ by 1.2e-5 rad or multiples
VELOCITY_NOISE = 2e-3  # [rad/s], on recordings of a UR10e
STANDING = 1e-6  # [rad/s] below which a joint reports that it stands: exactly 0


@dataclass(frozen=True)
class Sensors:
    """How a motion is observed."""

    current_noise: Array  # (J,) [A] sd
    colour: float = 0.0  # [-] AR(1) coefficient of that noise from row to row, in [0, 1)
    encoder_step: float = ENCODER_STEP  # [rad] at the joint; 0: none
    velocity_noise: float = VELOCITY_NOISE  # [rad/s] sd while moving
    temperature: float = TEMPERATURE  # [°C] of all joints
    cycle: float = 0.002  # [s] of the controller; stamps are multiples of it

    def __post_init__(self) -> None:
        object.__setattr__(self, "current_noise", frozen(self.current_noise))
        assert 0.0 <= self.colour < 1.0, "noise is stationary"

    def stamps(self, trajectory: Trajectory) -> Array:
        """Controller cycles closest to the trajectory's rows, (N,) [s]."""
        if trajectory.step < self.cycle * (1.0 - 1e-9):
            most, asked = 1.0 / self.cycle, 1.0 / trajectory.step
            raise InputError(f"the controller reports at {most:g} Hz; {asked:g} Hz is too much")
        cycles = np.round(trajectory.t / self.cycle)
        return np.round(cycles * self.cycle, 9)  # .694, not .6940000000000001


def typical_sensors(arm: Arm) -> Sensors:
    """Sensors as on recordings of real arms, scaled to this one."""
    drive = population(arm).typical().drive
    share = np.array(NOISE_SHARE) if arm.joints == len(NOISE_SHARE) else np.median(NOISE_SHARE)
    return Sensors(share * drive.coulomb / drive.gain)


def perfect_sensors(arm: Arm) -> Sensors:
    """Sensors that report what is."""
    return Sensors(np.zeros(arm.joints), encoder_step=0.0, velocity_noise=0.0)


def observe(
    dynamics: Dynamics, trajectory: Trajectory, sensors: Sensors, rng: np.random.Generator
) -> Log:
    """The log of an arm that follows `trajectory`.

    What the controller aims at comes of a typical arm of the type with the true payload: its
    target of current has friction in it, that of moment has none, as on recordings.
    """
    t = sensors.stamps(trajectory)
    aimed = _aims(dynamics, trajectory, sensors, t)
    return Log(t, aimed | _sensed(dynamics, trajectory, sensors, aimed, t, rng))


def _aims(
    dynamics: Dynamics, trajectory: Trajectory, sensors: Sensors, t: Array
) -> dict[str, Array]:
    """What the controller asks for."""
    nominal = replace(population(dynamics.arm).typical(), payload=dynamics.payload)
    joints = trajectory.joints
    return {
        "target_q": blockwise(lambda t: trajectory.at(t).q, t, joints),
        "target_qd": blockwise(lambda t: trajectory.at(t).v, t, joints),
        "target_qdd": blockwise(lambda t: trajectory.at(t).a, t, joints),
        "target_current": current(nominal, trajectory, t, sensors.temperature),
        "target_moment": blockwise(lambda t: nominal.load(trajectory.at(t)), t, joints),
    }


def _sensed(
    dynamics: Dynamics,
    trajectory: Trajectory,
    sensors: Sensors,
    aimed: dict[str, Array],
    t: Array,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """What the sensors give. Current leads the motion: it is that of a moment later."""
    q = quantised(aimed["target_q"], sensors.encoder_step)
    later = t + dynamics.drive.time_offset
    amperes = current(dynamics, trajectory, later, sensors.temperature)
    amperes += coloured(rng, len(t), sensors.current_noise, sensors.colour)
    return {
        "actual_q": q,
        "actual_qd": jittered(aimed["target_qd"], sensors.velocity_noise, rng),
        "actual_current": amperes,
        "joint_temperatures": np.broadcast_to(sensors.temperature, q.shape),
        "actual_TCP_pose": tool_pose(dynamics.arm, q),
    }


def quantised(q: Array, step: float) -> Array:
    """Angles as an encoder of this step [rad] tells them."""
    return np.round(q / step) * step if step else q


def jittered(v: Array, sd: float, rng: np.random.Generator) -> Array:
    """Velocities with white noise where a joint moves; real controllers report 0 at rest."""
    if not sd:
        return v
    noisy = rng.standard_normal(v.shape)  # one array of this size is enough: it may be an hour's
    noisy *= sd
    noisy += v
    noisy[np.abs(v) <= STANDING] = 0.0
    return noisy


def coloured(rng: np.random.Generator, rows: int, sd: Array, colour: float) -> Array:
    """Stationary AR(1) noise of standard deviation `sd`, (rows, J):

    e_t = c e_{t-1} + sqrt(1 - c²) sd w_t
    """
    white = rng.standard_normal((rows, len(sd)))
    white[1:] *= np.sqrt(1.0 - colour**2)  # the first row is drawn from the stationary law
    white *= sd
    return np.asarray(lfilter([1.0], [1.0, -colour], white, axis=0)) if colour else white
