"""Warm-up: temperatures of an arm that follows a trajectory, and their effect on friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, friction_torque
from urdyn.simulate.heat import IDLE_RISE, STEP, Heat
from urdyn.simulate.rigid import transmitted
from urdyn.simulate.schedule import Course, Event, course
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.types import Array

SAMPLES = 10  # of the losses per step
DRY = ("coulomb", "structural", "stribeck")  # friction terms that warmth does not affect
PASSES = 4  # iterations of losses and warmth: each removes some 90 % of the error


@dataclass(frozen=True, eq=False)
class Warmth:
    """An event: temperatures of joints, and their effect on viscous friction."""

    t: Array  # (M,) [s]
    temperature: Array  # (M, J) [°C] of the joints
    lubricant: Array  # (M, J) [°C]
    softening: Array  # (M, J) [-]
    onset: float = -np.inf  # [s]: from the beginning

    def befall(self, course: Course) -> Course:
        """Linear interpolation between the times."""
        return replace(
            course,
            temperature=self._at(course.t, self.temperature),
            viscous=course.viscous * self._at(course.t, self.softening),
        )

    @property
    def end(self) -> Array:
        """Joints and lubricant at the last time, (2, J) [°C]."""
        return np.stack([self.temperature[-1], self.lubricant[-1]])

    def _at(self, t: Array, values: Array) -> Array:
        if len(values) == 1:
            return np.broadcast_to(values, (len(t), values.shape[1]))
        return np.column_stack([np.interp(t, self.t, column) for column in values.T])


def steady(temperature: float, joints: int) -> Warmth:
    """Joints at a constant temperature."""
    same = np.full((1, joints), temperature)
    return Warmth(np.zeros(1), same, same, np.ones((1, joints)))


def warm_up(
    dynamics: Dynamics,
    trajectory: Trajectory,
    heat: Heat,
    events: Sequence[Event] = (),
    start: Array | None = None,
) -> Warmth:
    """Warm-up of an arm that follows a trajectory.

    Losses reduce friction, and friction causes the losses: a few passes make them consistent.

    Args:
        start: joints and lubricant before, (2, J) [°C]; None: the arm was switched off.
    """
    start = heat.cold if start is None else start
    fine = np.arange(0.0, float(trajectory.t[-1]), STEP / SAMPLES) + 0.5 * STEP / SAMPLES
    fine = fine[: max(len(fine) // SAMPLES, 1) * SAMPLES]
    parts = [_powers(dynamics, trajectory, events, heat, fine[rows]) for rows in blocks(len(fine))]
    dry, wet, room = (_means(np.concatenate(powers)) for powers in zip(*parts, strict=True))
    ambient = heat.ambient + room[:, 0]
    soft = np.ones_like(wet)
    for _ in range(PASSES):
        joints = heat.follow(dry + soft * wet, ambient, start)
        soft = heat.softening(joints[1], dynamics.drive.temperature)
    whole = np.concatenate([start[:, None], joints], axis=1)
    stamps = STEP * np.arange(float(whole.shape[1]))
    softening = heat.softening(whole[1], dynamics.drive.temperature)
    return Warmth(stamps, whole[0], whole[1], softening)


def _powers(
    dynamics: Dynamics, trajectory: Trajectory, events: Sequence[Event], heat: Heat, t: Array
) -> tuple[Array, Array, Array]:
    """Both losses (N, J) [W] and the rise of the room's temperature (N, 1) [K], at times (N,)."""
    happening = course(dynamics, events, t)
    return *losses(dynamics, trajectory, happening, heat), happening.ambient[:, None]


def losses(
    dynamics: Dynamics, trajectory: Trajectory, course: Course, heat: Heat
) -> tuple[Array, Array]:
    """Heat in the joints at the times of a course, (N, J) [W]: non-viscous, and viscous.

    Only sliding friction counts, since presliding stores next to no energy; copper losses are those
    of the load's current.
    """
    motion, drive = trajectory.at(course.t), dynamics.drive
    load = transmitted(dynamics, course, motion)
    at = Contact(motion.q, motion.v, motion.temperature, load, np.sign(motion.v))
    dry = friction_torque(at, drive, DRY, {"coulomb": course.coulomb}) * motion.v
    copper = heat.copper * (load / (drive.gain * course.health)) ** 2
    idle = IDLE_RISE / heat.resistance
    return idle + dry + copper, drive.viscous * course.viscous * motion.v**2


def _means(values: Array) -> Array:
    """Means over the samples of each step, (N, ...) -> (M, ...); too few form one step."""
    width = min(SAMPLES, len(values))
    return np.asarray(values.reshape(-1, width, values.shape[1]).mean(axis=1))
