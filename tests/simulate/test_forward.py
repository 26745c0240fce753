"""The closed loop lives through what the equation says, and rings when it is asked to."""

from functools import partial

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.simulate import (
    forward,
    fourier,
    observe,
    parse_fault,
    perfect_sensors,
    typical_gears,
    virtual_arm,
)
from urdyn.types import Motion

HALF = 4.0  # [s] into the run, when faults begin


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur10e")


@pytest.fixture(scope="module")
def dynamics(arm):
    return virtual_arm(arm, 1)


@pytest.fixture(scope="module")
def asked(arm):
    return fourier(arm, 2.0 * HALF, 500.0, np.random.default_rng(0))


def seen(dynamics, asked, *faults, fidelity=forward):
    events = [parse_fault(fault, 6) for fault in faults]
    sensors = perfect_sensors(dynamics.arm)
    return observe(dynamics, asked, sensors, np.random.default_rng(0), events, fidelity)


@pytest.fixture(scope="module")
def healthy(dynamics, asked):
    return seen(dynamics, asked)


def differs(log, other, rows=slice(None)):
    change = log.joint("actual_current")[rows] - other.joint("actual_current")[rows]
    return np.sqrt(np.mean(change**2, axis=0))


def test_the_arm_goes_where_it_is_asked_to(healthy, asked):
    error = np.abs(healthy.joint("actual_q") - asked.q)
    assert error.max() < 5e-3


def test_the_current_is_what_the_equation_says_of_the_motion(dynamics, healthy):
    q, v = healthy.joint("actual_q"), healthy.joint("actual_qd")
    a = np.gradient(v, healthy.t, axis=0)
    nothing = np.full_like(q, np.nan)
    said = dynamics.current(Motion(healthy.t, q, v, a, np.zeros_like(q), nothing, nothing))
    current = healthy.joint("actual_current")
    settled = slice(100, -1)
    error = np.linalg.norm((said - current)[settled], axis=0)
    # Current is held for a cycle in which friction turns over; a per cent or two is left of that.
    assert (error < 0.03 * np.linalg.norm(current[settled], axis=0)).all()


def test_elastic_gears_follow_the_same_motion(arm, dynamics, asked, healthy):
    soft = seen(dynamics, asked, fidelity=partial(forward, gears=typical_gears(arm)))
    twist = dynamics.load(asked.at(asked.t)) / typical_gears(arm).stiffness
    apart = np.abs(soft.joint("actual_q") - healthy.joint("actual_q")).max(axis=0)
    assert (apart < 2e-4 + 2.0 * np.abs(twist).max(axis=0)).all()


@pytest.mark.parametrize(
    "fault",
    [
        f"friction_increase:joint=1,onset={HALF},rate=0.1",
        f"health_degradation:joint=1,onset={HALF},rate=0.05",
    ],
)
def test_both_fidelities_agree_on_a_fault(dynamics, asked, healthy, fault):
    from urdyn.simulate import inverse

    after, before = slice(int(HALF * 500) + 50, None), slice(0, int(HALF * 500))
    lived = seen(dynamics, asked, fault)
    assert differs(lived, healthy, before).max() == 0.0
    calm = seen(dynamics, asked, fidelity=inverse)
    told = differs(seen(dynamics, asked, fault, fidelity=inverse), calm, after)
    np.testing.assert_allclose(differs(lived, healthy, after)[1], told[1], rtol=0.05)


def test_a_loop_whose_gain_grows_rings(dynamics, asked, healthy):
    ringing = seen(dynamics, asked, f"controller_instability:joint=2,onset={HALF},rate=20")
    change = differs(ringing, healthy, slice(int((HALF + 1.0) * 500), None))
    assert change[2] > 1.0 > change[5]


def test_a_push_is_felt_by_the_joints_that_carry_the_link(dynamics, asked, healthy):
    pushed = seen(dynamics, asked, f"collision:link=2,onset={HALF},force=0/60/60,duration=0.2")
    change = differs(pushed, healthy, slice(int(HALF * 500), int((HALF + 0.4) * 500)))
    assert change[:3].max() > 10.0 * change[3:].max()


def test_the_same_run_twice_is_the_same(dynamics, asked, healthy):
    again = seen(dynamics, asked)
    np.testing.assert_array_equal(again.joint("actual_current"), healthy.joint("actual_current"))
