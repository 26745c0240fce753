"""The closed loop lives through what the equation says, and rings when it is asked to."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from urdyn.model.arm import load_arm
from urdyn.model.drive import TIMES
from urdyn.model.population import OPTIONAL
from urdyn.simulate import (
    forward,
    fourier,
    observe,
    parse_fault,
    perfect_sensors,
    typical_gears,
    virtual_arm,
)
from urdyn.simulate.observe import log_and_links
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.watched import watched
from urdyn.types import Motion

HALF = 2.5  # [s] into the run, when faults begin
CYCLE = 0.002  # [s] of the controller, and from row to row


@pytest.fixture(scope="module")
def arm():
    return load_arm("ur10e")


@pytest.fixture(scope="module")
def dynamics(arm):
    return virtual_arm(arm, 1)


def first(seconds, whole):
    """The first seconds of a trajectory."""
    n = round(seconds / CYCLE)
    return Trajectory(whole.t[:n], whole.q[:n], whole.v[:n], whole.a[:n])


@pytest.fixture(scope="module")
def asked(arm):
    return first(2.0 * HALF, fourier(arm, 8.0, 500.0, np.random.default_rng(0)))


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


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


def equation(dynamics, log) -> np.ndarray:
    """Currents (N, J) that the equation has for the motion that a forward run reports."""
    q, v = log.joint("actual_q"), log.joint("actual_qd")
    a, none = np.gradient(v, log.t, axis=0), np.full_like(q, np.nan)
    motion = Motion(log.t, q, v, a, np.zeros_like(q), none, log.joint("joint_temperatures"))
    return dynamics.current(motion)


def off(said, log) -> np.ndarray:
    """By how much these currents differ from the log's, rms of each joint over the log's."""
    current, settled = log.joint("actual_current")[100:-10], said[100:-10]
    return np.linalg.norm(settled - current, axis=0) / np.linalg.norm(current, axis=0)


OPTIONS = [(), *((name,) for name in (*sorted(OPTIONAL), "health", *TIMES))]


@pytest.mark.parametrize("terms", [*OPTIONS, sum(OPTIONS, ())], ids="+".join)
def test_the_current_is_what_the_equation_says_of_the_motion(arm, dynamics, asked, terms):
    """Whatever terms the drives have, and not without any of them: one law, solved both ways."""
    drawn = vars(virtual_arm(arm, 1, terms=OPTIONAL).drive)
    other = {"health": np.full(arm.joints, 0.8), "friction_lead": 0.008, "time_offset": 3 * CYCLE}
    values = {name: (drawn | other)[name] for name in terms}
    warm = replace(perfect_sensors(arm), temperature=dynamics.drive.temperature[0] + 10.0)

    def with_drive(**terms):
        return replace(dynamics, drive=replace(dynamics.drive, **terms))

    def said(**terms):
        # Of a motion with corners Taylor's series knows less than its rows do.
        rows = round(terms.pop("time_offset", 0.0) / CYCLE)
        return np.roll(equation(with_drive(**terms), log), -rows, axis=0)

    log = observe(with_drive(**values), asked, warm, np.random.default_rng(0), fidelity=forward)
    # A joint that turns round takes some ten cycles for the bristles' distance: what a straight
    # line leaves of each cycle is an eighth of its hundredth, in friction that is all the current.
    assert (off(said(**values), log) < 0.005).all()
    for name in terms:
        without = {k: v for k, v in values.items() if k != name}
        assert off(said(**without), log).max() > 0.02, name


def test_elastic_gears_follow_the_same_motion(arm, dynamics, asked, healthy):
    part = first(0.5 * HALF, asked)  # steps of elastic gears are many
    soft = seen(dynamics, part, fidelity=partial(forward, gears=typical_gears(arm)))
    twist = dynamics.load(part.at(part.t)) / typical_gears(arm).stiffness
    apart = np.abs(soft.joint("actual_q") - healthy.joint("actual_q")[: len(soft)]).max(axis=0)
    assert (apart < 2e-4 + 2.0 * np.abs(twist).max(axis=0)).all()


def test_a_tracker_sees_links_which_lag_behind_their_motors_by_the_load(arm, dynamics):
    """Standing still, load = k (motor - link): encoders are on the motors."""
    t, gears = np.arange(250) * CYCLE, typical_gears(arm)
    pose = np.tile([0.3, -0.8, 0.9, -0.4, 1.2, 0.1], (len(t), 1))
    held = Trajectory(t, pose, 0 * pose, 0 * pose)
    rigid, soft = (
        log_and_links(dynamics, held, perfect_sensors(arm), rng(), (), partial(forward, gears=g))
        for g in (None, gears)
    )
    np.testing.assert_array_equal(rigid[1], rigid[0].joint("actual_q"))
    log, links = soft
    lag, load = gears.stiffness * (log.joint("actual_q") - links), dynamics.load(held.at(t))
    # From the first row on: links that fell from unwound gears would swing by all of it.
    np.testing.assert_allclose(lag[:, 1:3], load[:, 1:3], rtol=0.02)
    poses = [watched(dynamics, t, q, 50.0, rng()) for q in (links, log.joint("actual_q"))]
    apart = np.linalg.norm([poses[0].channels[k] - poses[1].channels[k] for k in "xyz"], axis=0)
    assert apart[-1] > 1e-3


def test_a_loop_is_tuned_to_the_rotors_that_it_turns(arm, dynamics):
    """However light: one that asks for ten times the torque in each cycle rings from the first."""
    t, light = np.arange(50) * CYCLE, np.where(np.arange(6) < 3, dynamics.drive.rotor_inertia, 0.02)
    pose = np.tile([0.3, -0.8, 0.9, -0.4, 1.2, 0.1], (len(t), 1))
    held, elastic = (
        Trajectory(t, pose, 0 * pose, 0 * pose),
        partial(forward, gears=typical_gears(arm)),
    )
    other = replace(dynamics, drive=replace(dynamics.drive, rotor_inertia=light))
    log = seen(other, held, fidelity=elastic)
    assert np.abs(log.joint("actual_qd")).max() < 0.1


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
