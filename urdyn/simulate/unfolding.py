"""The truth over time: an arm's parameters under events, as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.simulate.mishaps import Collision, SensorFault
from urdyn.simulate.schedule import Course, Event, Handling, course
from urdyn.types import Array, Log

STEP = 0.5  # [s] between rows at most
SINE = np.linspace(0.0, 1.0, 9)  # [-] of half a sine: linear interpolation is within 2 % of it
AXES = "xyz"


def unfolding(dynamics: Dynamics, events: Sequence[Event], duration: float) -> Log:
    """Every parameter over `duration` [s], in SI, with names like elbow_joint.coulomb.

    Rows are at every STEP, at the end, and whenever an event begins, peaks or ends.
    """
    grid = np.append(np.arange(0.0, duration, STEP), duration)
    t = np.unique(np.concatenate([grid, *map(_moments, events)]))
    t = t[(t >= 0.0) & (t <= duration)]
    return Log(t, dict(_columns(dynamics, course(dynamics, events, t))))


def varying(unfolded: Log) -> dict[str, list[float]]:
    """The columns that change, and the times [s]; empty where nothing does."""
    changing = {k: v for k, v in unfolded.channels.items() if (v != v[0]).any()}
    columns = {"t": unfolded.t} | changing if changing else {}
    return {name: values.tolist() for name, values in columns.items()}


def _moments(event: Event) -> Array:
    """Begin, peaks and end of an event that may be shorter than a step, (M,) [s]."""
    match event:
        case Collision():
            return event.onset + event.duration * SINE
        case SensorFault():
            return event.onset + np.array([0.0, event.duration])
        case Handling():
            return event.begin
        case _:
            return np.array([event.onset])


def _columns(dynamics: Dynamics, now: Course) -> Iterator[tuple[str, Array]]:
    """Name and values, (N,) each."""
    arm, drive = dynamics.arm, dynamics.drive
    joints = {
        "coulomb": drive.coulomb * now.coulomb,
        "viscous": drive.viscous * now.viscous,
        "health": now.health,
        "half_gap": now.half_gap,
        "encoder_offset": now.encoder_offset,
        "loop_gain": now.loop_gain,
        "temperature": now.temperature,
        "sensor_bias": now.sensor_bias,
        "sensor_noise": now.sensor_noise,
        "sensor_stuck": now.sensor_stuck.astype(float),
        "sensor_dropped": now.sensor_dropped.astype(float),
    }
    for j, joint in enumerate(arm.joint_names):
        yield from ((f"{joint}.{name}", values[:, j]) for name, values in joints.items())
    for j, link in enumerate(arm.link_names):
        yield from ((f"{link}.force_{axis}", now.push[:, j, k]) for k, axis in enumerate(AXES))
    mass = now.payload[:, 0]
    com = now.payload[:, 1:4] / np.where(mass, mass, 1.0)[:, None]
    yield from ((f"payload.com_{axis}", com[:, k]) for k, axis in enumerate(AXES))
    yield from (("payload.mass", mass), ("loop_delay", now.loop_delay), ("ambient", now.ambient))
