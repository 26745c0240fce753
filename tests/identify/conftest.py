"""What the tests of this room share: an arm with every term there is, and what it lives through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify import Noise
from urdyn.identify.unknowns import PayloadPrior, Unknowns
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import OPTIONAL, population
from urdyn.simulate import Payload, fourier, virtual_arm
from urdyn.types import Motion


@pytest.fixture(scope="session")
def point(ur5e: Arm) -> Dynamics:
    """An arm with every term and a payload, whose current leads its motion."""
    drawn = virtual_arm(ur5e, 3, Payload(1.5, np.array([0.01, -0.02, 0.06])), OPTIONAL)
    return replace(drawn, drive=replace(drawn.drive, time_offset=0.004, friction_lead=0.003))


@pytest.fixture(scope="session")
def motion(point: Dynamics) -> Motion:
    """Twelve seconds of warm-up at 100 Hz, the current free of noise."""
    trajectory = fourier(point.arm, 12.0, 100.0, np.random.default_rng(2))
    going = trajectory.at(trajectory.t)
    warm = np.linspace(30.0, 40.0, len(going))[:, None] + np.zeros(6)
    going = replace(going, temperature=warm)
    return replace(going, current=point.current(going))


@pytest.fixture(scope="session")
def noise() -> Noise:
    """White on the first joints, coloured on the last, tails on all."""
    ar = np.array([[0.0, 0.0]] * 3 + [[0.5, 0.2], [0.3, 0.0], [-0.4, 0.1]])
    return Noise(np.full(6, 0.1), np.full(6, 0.05), np.linspace(5.0, 100.0, 6), ar)


@pytest.fixture(scope="session")
def unknowns(ur5e: Arm) -> Unknowns:
    """Everything that can be sought of an arm, and a payload."""
    return Unknowns(population(ur5e), (OPTIONAL,) * 6, payloads=(PayloadPrior(),))
