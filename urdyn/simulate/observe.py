"""What a controller reports of a motion: RTDE's columns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from urdyn.model.body import centre_of_mass
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population
from urdyn.simulate.follow import Followed, follow, inverse
from urdyn.simulate.noise import banded, coloured, jittered, quantised, told
from urdyn.simulate.schedule import Course, Event
from urdyn.simulate.sensors import Sensors
from urdyn.simulate.tool import tool_pose
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.warmth import steady
from urdyn.simulate.wrench import has_force_sensor, wrenches
from urdyn.types import Array, Log, Motion, frozen

# How an arm executes a trajectory: the arm, the trajectory, the times, the events.
Fidelity = Callable[[Dynamics, Trajectory, Array, Sequence[Event]], Iterator[Followed]]
Rows = tuple[slice, dict[str, Array]]  # some rows of a log, and their channels


def observe(
    dynamics: Dynamics,
    trajectory: Trajectory,
    sensors: Sensors,
    rng: np.random.Generator,
    events: Sequence[Event] = (),
    fidelity: Fidelity = inverse,
) -> Log:
    """The log of an arm that follows `trajectory` while `events` happen to it.

    The controller's targets are those of a typical arm of the type with the first day's true
    payload, to which it is set: its target current includes friction, its target moment does not,
    as in recordings.
    """
    return log_and_links(dynamics, trajectory, sensors, rng, events, fidelity)[0]


def log_and_links(
    dynamics: Dynamics,
    trajectory: Trajectory,
    sensors: Sensors,
    rng: np.random.Generator,
    events: Sequence[Event],
    fidelity: Fidelity = inverse,
) -> tuple[Log, Array]:
    """What `observe` gives, and the links' true angles, (N, J) [rad], which no log contains."""
    t = sensors.stamps(trajectory)
    always = steady(sensors.temperature, trajectory.joints)
    aimed = _gathered(_aims(dynamics, trajectory, (always,), t), len(t))
    lived = fidelity(dynamics, trajectory, t, (always, *events))
    sensed = _gathered(_sensed(dynamics, trajectory.step, sensors, lived, len(t), rng), len(t))
    links = sensed.pop("links")
    return Log(t, aimed | sensed | _set(dynamics.payload, len(t))), links


def _set(payload: Array, rows: int) -> dict[str, Array]:
    """The controller's payload setting for the first day's payload, (10,)."""
    centre = np.nan_to_num(centre_of_mass(payload))
    return {"payload": np.full(rows, payload[0]), "payload_cog": np.tile(centre, (rows, 1))}


def _aims(
    dynamics: Dynamics, trajectory: Trajectory, events: Sequence[Event], t: Array
) -> Iterator[Rows]:
    """The controller's targets."""
    nominal = replace(population(dynamics.arm).typical(), payload=dynamics.payload)
    for part in follow(nominal, trajectory, t, events):
        yield (
            part.rows,
            {
                "target_q": part.motion.q,
                "target_qd": part.motion.v,
                "target_qdd": part.motion.a,
                "target_current": part.current,
                "target_moment": part.load,
            },
        )


def _sensed(
    dynamics: Dynamics,
    step: float,
    sensors: Sensors,
    lived: Iterable[Followed],
    rows: int,
    rng: np.random.Generator,
) -> Iterator[Rows]:
    """The sensors' channels, and the links' angles."""
    ill, felt = rng.spawn(2)  # so that optional channels leave the other noise unchanged
    noise = _current_noise(sensors, rows, step, rng)
    last = np.zeros(dynamics.arm.joints)
    for part in lived:
        now, motion = part.course, part.motion
        amperes = told(part.current + noise[part.rows], now, last, ill)
        last = amperes[-1]
        off = now.encoder_offset
        q = quantised(motion.q + off if off.any() else motion.q, sensors.encoder_step)
        yield (
            part.rows,
            {
                "links": part.links,
                "actual_q": q,
                "actual_qd": jittered(motion.v, sensors.velocity_noise, rng),
                "actual_current": amperes,
                "joint_temperatures": quantised(now.temperature, sensors.temperature_step),
                "actual_TCP_pose": tool_pose(dynamics.arm, q),
                **_wrenches(dynamics, sensors, now, motion, felt),
            },
        )


def _current_noise(sensors: Sensors, rows: int, step: float, rng: np.random.Generator) -> Array:
    if sensors.bands:
        return banded(rng, rows, sensors.current_noise, sensors.bands, step)
    return coloured(rng, rows, sensors.current_noise, sensors.colour)


def _wrenches(
    dynamics: Dynamics,
    sensors: Sensors,
    course: Course,
    motion: Motion,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """The measured wrench at the flange, where the controller reports it."""
    if sensors.wrench_noise is None:
        return {}
    sd = np.repeat(sensors.wrench_noise, 3)
    names = ("actual_TCP_force", "ft_raw_wrench")[: 1 + has_force_sensor(dynamics.arm)]
    true = wrenches(dynamics, course, motion)
    return {name: true[name] + sd * rng.standard_normal(true[name].shape) for name in names}


def _gathered(parts: Iterable[Rows], rows: int) -> dict[str, Array]:
    """The channels of all rows, from those of each block."""
    whole: dict[str, Array] = {}
    for where, values in parts:
        for name, value in values.items():
            if name not in whole:
                whole[name] = np.empty((rows, value.shape[1]))
            whole[name][where] = value
    return {name: frozen(values) for name, values in whole.items()}  # not copied
