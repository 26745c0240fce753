"""The virtual arm: a random one of its type at work, with its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_count
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population
from urdyn.simulate.deviations import deviated, draw_deviations
from urdyn.simulate.heat import typical_heat
from urdyn.simulate.motions import plan
from urdyn.simulate.observe import observe
from urdyn.simulate.payload import Payload
from urdyn.simulate.schedule import Event
from urdyn.simulate.sensors import Sensors, typical_sensors
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.truth import truth
from urdyn.simulate.warmth import warm_up
from urdyn.simulate.work import Work
from urdyn.types import Log

LARGEST = 2**63 - 1  # largest seed that TOML can hold


def virtual_arm(
    arm: Arm,
    seed: int,
    payload: Payload | None = None,
    terms: frozenset[str] = frozenset(),
    deviations: bool = False,
) -> Dynamics:
    """The arm of this seed, drawn from the population that identification believes in.

    Args:
        terms: optional terms of this arm's friction, by their names in `Drive`.
        deviations: its joints deviate from the drawing as a real arm's do.
    """
    given_count(seed, "seed", 0, LARGEST)
    dynamics = population(arm).draw(np.random.default_rng(seed), terms)
    if deviations:
        dynamics = with_deviations(dynamics, seed)
    return replace(dynamics, payload=payload.inertials()) if payload else dynamics


def with_deviations(dynamics: Dynamics, seed: int) -> Dynamics:
    """The arm as built, not as drawn; independent of other random choices."""
    moved = draw_deviations(dynamics.arm, np.random.default_rng([seed, 0, 1]))
    return replace(dynamics, arm=deviated(dynamics.arm, moved))


def happening(
    dynamics: Dynamics, work: Work, events: Sequence[Event], heat: bool
) -> tuple[Event, ...]:
    """All events of an arm at work: `events`, what it handles, and how it warms up by these."""
    found: tuple[Event, ...] = (*events, *work.handling)
    if not heat:
        return found
    return (*found, warm_up(dynamics, work.trajectory, typical_heat(dynamics), found))


def streams(
    seed: int, payload: Payload | None, run: int = 0
) -> tuple[np.random.Generator, np.random.Generator]:
    """Generators of motion and sensors: neither another trajectory nor another sensor changes the
    arm. With another payload noise is new and the motion is the same; in another run both are new.
    """
    given_count(seed, "seed", 0, LARGEST)
    if given_count(run, "run", 0):
        moving, noisy = np.random.default_rng((seed, run)).spawn(2)
        return moving, noisy
    milligrams = round(1e6 * payload.mass) if payload else 0
    return np.random.default_rng([seed, 0]), np.random.default_rng([seed, 1 + milligrams])


def simulate(
    arm: Arm,
    duration: float,
    rate: float,
    seed: int,
    *,
    run: int = 0,
    trajectory: Trajectory | None = None,
    payload: Payload | None = None,
    sensors: Sensors | None = None,
    terms: frozenset[str] = frozenset(),
    motion: str = "fourier",
    events: Sequence[Event] = (),
    heat: bool = False,
    deviations: bool = False,
) -> tuple[Log, dict[str, Any]]:
    """A log of the virtual arm of this seed, and its truth; the same seed gives the same bytes.

    Args:
        run: another motion and other noise of that arm, 0 or more.
        trajectory: what the arm does, instead of a random motion of `duration` and `rate`.
        terms: optional terms of the arm's friction, by their names in `Drive`.
        motion: fourier, point_to_point, pick_and_place or shift.
        events: faults, and whatever else happens to the arm.
        heat: joints begin cold and warm up.
        deviations: the arm's joints deviate from the drawing as a real arm's do.
    """
    motion_rng, sensor_rng = streams(seed, payload, run)
    dynamics = virtual_arm(arm, seed, payload, terms, deviations)
    sensors = typical_sensors(arm) if sensors is None else sensors
    if trajectory is None:
        work = plan(motion, dynamics.rigid, duration, rate, motion_rng)
    elif trajectory.joints != arm.joints:
        told = f"{arm.name} has {arm.joints}"
        raise InputError(f"the trajectory is one of {trajectory.joints} joints; {told}")
    else:
        work = Work(trajectory)
    found = happening(dynamics, work, events, heat)
    log = observe(dynamics, work.trajectory, sensors, sensor_rng, found)
    return log, truth(dynamics, sensors, seed, found, float(log.t[-1]))
