"""The forward fidelity: an arm under its controller, tick by tick."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population, rated_torque
from urdyn.simulate.closed_loop import closed_loop
from urdyn.simulate.controller import typical_controller
from urdyn.simulate.follow import Followed
from urdyn.simulate.plant import Gears
from urdyn.simulate.schedule import Event, course
from urdyn.simulate.trajectory import Trajectory, blocks
from urdyn.types import Array, Motion

SERVO = 0.002  # [s]; a CB3, which sends every 8 ms, leaves the loop to its joints in between
STIFFNESS = 100.0  # [1/rad] of a gear, per rated torque
GEAR_DAMPING = 0.1  # [-] damping ratio of the link on its gear


def typical_gears(arm: Arm) -> Gears:
    """Elastic gears, with a stiffness in proportion to their rated torque."""
    straight = np.zeros(arm.joints)
    mass = np.diag(arm.torque_derivatives(straight, straight, straight)[2])
    stiffness = STIFFNESS * rated_torque(arm)
    return Gears(stiffness, 2.0 * GEAR_DAMPING * np.sqrt(stiffness * np.minimum(mass, 1.0)))


def forward(
    dynamics: Dynamics,
    trajectory: Trajectory,
    t: Array,
    events: Sequence[Event] = (),
    gears: Gears | None = None,
) -> Iterator[Followed]:
    """The arm under its controller at times (N,) [s], from rest.

    Args:
        gears: elasticity of the gears; None: rigid, unless a fault opens a gap.
    """
    ticks = np.arange(round((t[-1] + dynamics.drive.time_offset) / SERVO) + 2) * SERVO
    asked = trajectory.at(ticks)
    lived = course(dynamics, events, ticks)
    if gears is None and lived.half_gap.any():
        gears = typical_gears(dynamics.arm)  # a gap needs elastic gears
    nominal = _nominal(dynamics)
    controller, targets = typical_controller(nominal), Trajectory(ticks, asked.q, asked.v, asked.a)
    loop = closed_loop(dynamics, controller, targets, nominal.torque(asked), lived, gears)
    rows = [(x.state.theta, x.state.omega, x.state.q, x.state.load, x.current) for x in loop]
    q, v, links, load, current = (np.array(column) for column in zip(*rows, strict=True))
    accelerated = np.gradient(v, SERVO, axis=0)
    for part in blocks(len(t)):
        at = np.rint(t[part] / SERVO).astype(np.intp)
        now = course(dynamics, events, t[part])
        motion = Motion(
            t=now.t,
            q=q[at],
            v=v[at],
            a=accelerated[at],
            jerk=asked.jerk[at],
            current=asked.current[at],
            temperature=now.temperature,
        )
        # A current is held from its tick to the next: its time is the middle between them.
        later = _between(current, (t[part] + dynamics.drive.time_offset) / SERVO - 0.5)
        yield Followed(part, now, motion, links[at], load[at], later)


def _nominal(dynamics: Dynamics) -> Dynamics:
    """The arm as its maker knows it: a typical one, but with its own motors.

    A loop that is tuned to ten times a rotor's inertia rings at half the controller's rate.
    """
    typical, own = population(dynamics.arm).typical(), dynamics.drive
    drive = replace(typical.drive, gain=own.gain, rotor_inertia=own.rotor_inertia)
    return replace(typical, drive=drive, payload=dynamics.payload)


def _between(values: Array, place: Array) -> Array:
    """Rows (N, J), linearly interpolated at fractional indices (M,) of at least 0."""
    place = np.maximum(place, 0.0)
    row = np.minimum(place.astype(np.intp), len(values) - 2)
    share = (place - row)[:, None]
    return np.asarray(values[row] + share * (values[row + 1] - values[row]))
