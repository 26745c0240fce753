"""Work that is repeated is that of an arm which is never switched off."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice

import numpy as np
import pytest

from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.simulate import (
    Fidelity,
    Trajectory,
    Work,
    forward,
    happening,
    inverse,
    observe,
    parse_fault,
    perfect_sensors,
    plan,
    typical_sensors,
    virtual_arm,
)
from urdyn.simulate.rounds import rounds
from urdyn.simulate.schedule import Event, Handling
from urdyn.simulate.there_and_back import there_and_back
from urdyn.types import Log

RATE, TURNS = 125.0, 3
FAULTS = (
    "friction_increase:joint=2,onset=1,rate=0.01",
    "payload_change:onset=0.5,mass=1",
    "joint_backlash:joint=1,onset=0.2,rate=0.0001",
)


@pytest.fixture(scope="module")
def dynamics(ur5e: Arm) -> Dynamics:
    return virtual_arm(ur5e, 5)


def work_of(dynamics: Dynamics, motion: str, duration: float) -> Work:
    rng = np.random.default_rng(1)
    return there_and_back(plan(motion, dynamics.rigid, duration, RATE, rng))


def in_one_go(work: Work) -> Work:
    """The same work TURNS times."""
    once = work.trajectory
    ways = (np.concatenate([way] * TURNS) for way in (once.q, once.v, once.a))
    later = np.arange(TURNS)[:, None] * len(once) * once.step
    handling = (
        Handling((done.begin + later).ravel(), np.concatenate([done.carried] * TURNS))
        for done in work.handling
    )
    return Work(Trajectory(once.step * np.arange(TURNS * len(once)), *ways), tuple(handling))


@pytest.mark.parametrize(
    ("fidelity", "motion", "duration", "heat", "faults"),
    [
        (inverse, "fourier", 4.0, True, FAULTS),
        (inverse, "pick_and_place", 9.0, False, FAULTS[:2]),
        pytest.param(forward, "fourier", 4.0, False, FAULTS[:1], marks=pytest.mark.slow),
    ],
)
def test_rounds_are_the_same_work_in_one_go(
    dynamics: Dynamics,
    fidelity: Fidelity,
    motion: str,
    duration: float,
    heat: bool,
    faults: Sequence[str],
) -> None:
    """Friction, load, faults and warmth go on over every seam: the same but for rounding."""
    work, sensors = work_of(dynamics, motion, duration), perfect_sensors(dynamics.arm)
    befalls: tuple[Event, ...] = tuple(parse_fault(x, dynamics.arm.joints) for x in faults)

    def seen(work: Work) -> Log:
        events = happening(dynamics, work, befalls, heat)
        rng = np.random.default_rng(0)
        return observe(dynamics, work.trajectory, sensors, rng, events, fidelity)

    later = rounds(dynamics, work, sensors, np.random.default_rng(0), befalls, heat, fidelity)
    logs, whole = [seen(work), *islice(later, TURNS - 1)], seen(in_one_go(work))
    np.testing.assert_allclose(np.concatenate([log.t for log in logs]), whole.t, atol=1e-9)
    for name in ("actual_q", "actual_current", "target_current", "joint_temperatures"):
        joined = np.concatenate([log.channels[name] for log in logs])
        np.testing.assert_allclose(joined, whole.channels[name], rtol=1e-9, atol=1e-8)


def test_noise_is_new_in_every_round(dynamics: Dynamics) -> None:
    """What two rounds of a healthy arm differ by has twice the variance of the sensors' noise."""
    work, sensors = work_of(dynamics, "fourier", 4.0), typical_sensors(dynamics.arm)
    first, second = islice(rounds(dynamics, work, sensors, np.random.default_rng(0)), 2)
    n = len(work.trajectory)
    for name, sd in (
        ("actual_current", sensors.current_noise),
        ("actual_qd", np.full(dynamics.arm.joints, sensors.velocity_noise)),
    ):
        apart = (second.channels[name] - first.channels[name])[1:-1]  # at rest, a joint reports 0
        share = (apart**2).mean(axis=0) / (2.0 * sd**2)
        np.testing.assert_allclose(share, 1.0, atol=5.0 * np.sqrt(2.0 / n))
