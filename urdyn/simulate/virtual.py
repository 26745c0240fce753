"""The virtual arm: one of its type at random, put to work, its truth told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from urdyn.model.arm import Arm, with_inertials
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import population
from urdyn.simulate.fourier import fourier
from urdyn.simulate.payload import Payload
from urdyn.simulate.sensors import Sensors, observe, typical_sensors
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.truth import truth
from urdyn.types import Log


def virtual_arm(
    arm: Arm, seed: int, payload: Payload | None = None, terms: frozenset[str] = frozenset()
) -> Dynamics:
    """The arm of this seed, drawn from the population that identification believes in.

    Args:
        terms: optional terms of friction that this arm has, by their names in `Drive`.
    """
    dynamics = population(arm).draw(np.random.default_rng(seed), terms)
    return replace(dynamics, payload=payload.inertials()) if payload else dynamics


def simulate(
    arm: Arm,
    duration: float,
    rate: float,
    seed: int,
    *,
    trajectory: Trajectory | None = None,
    payload: Payload | None = None,
    sensors: Sensors | None = None,
    terms: frozenset[str] = frozenset(),
) -> tuple[Log, dict[str, Any]]:
    """A log of the virtual arm of this seed, and its truth; the same seed gives the same bytes.

    Args:
        trajectory: what the arm does, instead of a Fourier excitation of `duration` and `rate`.
    """
    # Streams of their own: neither another trajectory nor another sensor makes another arm.
    # With another payload it is another run, so its noise is new; the motion asked for is the same.
    milligrams = round(1e6 * payload.mass) if payload else 0
    motion_rng, sensor_rng = (np.random.default_rng([seed, k]) for k in (0, 1 + milligrams))
    dynamics = virtual_arm(arm, seed, payload, terms)
    sensors = typical_sensors(arm) if sensors is None else sensors
    if trajectory is None:
        loaded = with_inertials(arm, dynamics.loaded())
        trajectory = fourier(loaded, duration, rate, motion_rng)
    return observe(dynamics, trajectory, sensors, sensor_rng), truth(dynamics, sensors, seed)
