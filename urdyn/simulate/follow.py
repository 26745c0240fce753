"""The open-loop arm: it follows a trajectory exactly, and its drives give the torque needed.

The inverse fidelity: friction is linear in its coefficients, so time-varying factors multiply
their features row by row.

    tau = tau_load + I_r a + sum_k c_k w_k(t) feature_k,    i = tau / (K z(t))
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import Contact, friction_torque
from urdyn.simulate.backlash import Flanks, first_flanks, in_gap
from urdyn.simulate.rigid import transmitted
from urdyn.simulate.ringing import ringing
from urdyn.simulate.schedule import Course, Event, course
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.simulate.warmth import steady
from urdyn.types import Array, Motion


@dataclass(frozen=True, eq=False)
class Followed:
    """Some rows of a trajectory as the arm executed them."""

    rows: slice
    course: Course
    motion: Motion  # of the motors, which may oscillate about the targets
    links: Array  # (N, J) [rad], which differ from the motors with elastic gears
    load: Array  # (N, J) [N·m] transmitted by the gears
    current: Array  # (N, J) [A] in the motors


def follow(
    dynamics: Dynamics, trajectory: Trajectory, t: Array, events: Sequence[Event] = ()
) -> Iterator[Followed]:
    """The arm at times (N,) [s], block by block; presliding is relaxed before the first."""
    drive, end, flanks = dynamics.drive, None, first_flanks(trajectory.joints)
    for rows in blocks(len(t)):
        # One row of the previous block, from which travel counts.
        lead = min(rows.start, 1)
        now = course(dynamics, events, t[rows.start - lead : rows.stop])
        motion = replace(trajectory.at(now.t), temperature=now.temperature)
        motion = ringing(motion, now)
        moved = dynamics.bristles(motion, end)
        end, s = moved.end, moved.together(drive.presliding_tail)
        load = transmitted(dynamics, now, motion)
        torque, flanks = _torque(dynamics, now, motion, load, s, flanks)
        amperes = torque / (drive.gain * now.health)
        motion = motion.slice(lead)
        yield Followed(rows, now.since(lead), motion, motion.q, load[lead:], amperes[lead:])


def inverse(
    dynamics: Dynamics, trajectory: Trajectory, t: Array, events: Sequence[Event] = ()
) -> Iterator[Followed]:
    """The arm at the stamps of a log, whose currents are those of a moment later."""
    offset = dynamics.drive.time_offset
    for part in follow(dynamics, trajectory, t + offset, events):
        if offset:
            now = course(dynamics, events, t[part.rows])
            motion = replace(trajectory.at(now.t), temperature=now.temperature)
            motion = ringing(motion, now)
            part = replace(part, course=now, motion=motion, links=motion.q)
        yield part


def current(dynamics: Dynamics, trajectory: Trajectory, t: Array, temperature: float) -> Array:
    """Motor current at times (N,) [s] of an arm at `temperature` [°C], (N, J) [A]."""
    events = (steady(temperature, trajectory.joints),)
    parts = [part.current for part in follow(dynamics, trajectory, t, events)]
    return np.concatenate(parts)


def _torque(
    dynamics: Dynamics, course: Course, motion: Motion, load: Array, s: Array, flanks: Flanks
) -> tuple[Array, Flanks]:
    """Torque of the drives, (N, J) [N·m], and the gears' flanks after it."""
    drive = dynamics.drive
    if course.half_gap.any():
        loose, flanks = in_gap(drive, course.half_gap, load, course.t, flanks)
        load = np.where(loose, 0.0, load)
    at = Contact(motion.q, motion.v, motion.temperature, load, s)
    friction = friction_torque(
        at, drive, factors={"coulomb": course.coulomb, "viscous": course.viscous}
    )
    return np.asarray(load + drive.rotor_inertia * motion.a + friction), flanks
