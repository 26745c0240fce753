"""Laws of heat: the balance of power closes, and a shift warms an arm as real ones are warmed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import Arm, load_arm
from urdyn.model.dynamics import Dynamics
from urdyn.simulate import (
    happening,
    observe,
    parse_fault,
    perfect_sensors,
    shift,
    simulate,
    typical_heat,
    virtual_arm,
    warm_up,
)
from urdyn.simulate.heat import IDLE_RISE
from urdyn.simulate.schedule import course
from urdyn.simulate.warmth import losses
from urdyn.simulate.work import Work

HOUR = 3600.0


@pytest.fixture(scope="module")
def dynamics(ur10e: Arm) -> Dynamics:
    return virtual_arm(ur10e, 3)


@pytest.fixture(scope="module")
def day(ur10e: Arm) -> Work:
    """Three hours of work."""
    return shift(ur10e, 3 * HOUR, 10.0, np.random.default_rng(2))


def test_a_steady_loss_warms_exponentially_to_r_times_p(dynamics):
    heat = typical_heat(dynamics)
    power = np.tile([[5.0, 10.0, 20.0, 1.0, 2.0, 3.0]], (4000, 1))
    joints, lubricant = heat.follow(power, np.full(4000, 20.0), np.full((2, 6), 20.0))
    t = np.arange(1.0, 4001.0)[:, None]
    rise = heat.resistance * power
    tau, lag = heat.time_constant, heat.lag
    np.testing.assert_allclose(joints, 20.0 + rise * (1.0 - np.exp(-t / tau)), rtol=1e-10)
    slow, fast = tau / (tau - lag) * np.exp(-t / tau), lag / (tau - lag) * np.exp(-t / lag)
    # Each step of 1 s takes its end for its mean: ahead by up to half a step of the joints' slope.
    wanted = 20.0 + rise * (1.0 - slow + fast)
    assert np.abs(lubricant - wanted).max() < 0.5 * (rise / tau).max() * 1.01


def test_heat_taken_up_is_losses_less_what_the_room_gets(dynamics):
    heat = typical_heat(dynamics)
    power = np.random.default_rng(0).uniform(0.0, 30.0, (3000, 6))
    start = np.full((2, 6), 30.0)
    T = np.vstack([start[:1], heat.follow(power, np.full(3000, 22.0), start)[0]])
    capacity = heat.time_constant / heat.resistance
    # Exact for steady power within each step, where the mean temperature follows from both ends.
    x = 1.0 / heat.time_constant
    weight = 1.0 + 1.0 / np.expm1(x) - 1.0 / x  # of the step's end in its mean
    mean = (1.0 - weight) * T[:-1] + weight * T[1:]
    given = ((mean - 22.0) / heat.resistance).sum(axis=0)
    taken = capacity * (T[-1] - T[0])
    np.testing.assert_allclose(power.sum(axis=0) - given, taken, rtol=1e-9)


def test_losses_are_the_work_of_friction_and_the_heat_of_the_copper(dynamics, day):
    heat = typical_heat(dynamics)
    t = np.arange(5.0, 605.0, 0.1)
    dry, wet = losses(dynamics, day.trajectory, course(dynamics, (), t), heat)
    motion, drive = day.trajectory.at(t), dynamics.drive
    load = dynamics.load(motion)
    sliding = drive.coulomb + drive.structural * np.abs(load)
    friction = (sliding * np.sign(motion.v) + drive.viscous * motion.v) * motion.v
    copper = heat.copper * (load / drive.gain) ** 2
    np.testing.assert_allclose(
        dry + wet, IDLE_RISE / heat.resistance + friction + copper, rtol=0, atol=1e-10
    )


def test_losses_and_warmth_agree(dynamics, day):
    """What `warm_up` returns satisfies its own equation: one more pass changes nothing."""
    heat = typical_heat(dynamics)
    warmth = warm_up(dynamics, day.trajectory, heat)
    fine = np.arange(0.05, warmth.t[-1], 0.1)
    dry, wet = losses(dynamics, day.trajectory, course(dynamics, (), fine), heat)
    dry, wet = (power.reshape(-1, 10, 6).mean(axis=1) for power in (dry, wet))
    again, _ = heat.follow(
        dry + warmth.softening[1:] * wet, np.full(len(dry), heat.ambient), heat.cold
    )
    assert np.abs(again - warmth.temperature[1:]).max() < 0.01  # [K]


@pytest.mark.parametrize(
    "robot", ["ur3e", "ur20", *(pytest.param(r, marks=pytest.mark.slow) for r in ("ur5e", "ur10e"))]
)
def test_a_shift_warms_an_arm_to_work_and_softens_its_friction(robot):
    arm = load_arm(robot)
    dynamics = virtual_arm(arm, 3)
    work = shift(arm, 3 * HOUR, 10.0, np.random.default_rng(5))
    *_, warmth = happening(dynamics, work, (), True)
    last = warmth.temperature[-1800:].mean(axis=0)
    assert np.all(warmth.temperature[0] == 22.0)
    assert 34.0 < np.median(last) < 46.0 and last.min() > 30.0 and last.max() < 52.0
    soft = warmth.softening[-1800:].mean(axis=0) / warmth.softening[0]
    assert 0.75 < np.median(soft) < 0.85 and np.all((soft > 0.70) & (soft < 0.90))


def test_friction_falls_after_the_joint_has_warmed(dynamics, day):
    """The lubricant lags the joint."""
    heat = typical_heat(dynamics)
    warmth = warm_up(dynamics, day.trajectory, heat)
    early = warmth.t < 600.0
    at_once = heat.softening(warmth.temperature[early], dynamics.drive.temperature)
    assert np.all(warmth.softening[early][1:] > at_once[1:])


def test_more_friction_makes_more_heat_in_that_joint_alone(dynamics, day):
    heat = typical_heat(dynamics)
    worn = (parse_fault("friction_increase:joint=3,onset=3600,rate=1,shape=step", 6),)
    healthy, sick = (warm_up(dynamics, day.trajectory, heat, e) for e in ((), worn))
    hotter = sick.temperature - healthy.temperature
    assert np.abs(hotter[:3600]).max() == 0.0 and hotter[-1, 3] > 1.0
    assert np.abs(np.delete(hotter, 3, axis=1)).max() == 0.0


def test_a_warmer_room_is_a_warmer_arm(dynamics, day):
    heat = typical_heat(dynamics)
    drift = (parse_fault("thermal_drift:rate=0.1,rise=6", 6),)
    cool, warm = (warm_up(dynamics, day.trajectory, heat, e) for e in ((), drift))
    # All of it but what friction no longer gives, after six time constants.
    hotter = warm.temperature[-1] - cool.temperature[-1]
    assert np.all((hotter > 4.5) & (hotter < 6.0))


def test_an_arm_that_stands_is_warmed_by_its_electronics_and_what_it_holds(ur5e):
    dynamics = virtual_arm(ur5e, 0)
    made = shift(ur5e, 600.0, 10.0, np.random.default_rng(0)).trajectory
    still = replace(made, q=0 * made.q, v=0 * made.v, a=0 * made.a)
    heat = replace(typical_heat(dynamics), copper=np.zeros(6))
    warmth = warm_up(dynamics, still, heat)
    wanted = 22.0 + IDLE_RISE * (1.0 - np.exp(-warmth.t / heat.time_constant))
    np.testing.assert_allclose(warmth.temperature, np.tile(wanted, (6, 1)).T, rtol=1e-9)


def test_an_arm_with_its_own_thermal_term_follows_that(ur5e):
    dynamics = virtual_arm(ur5e, 0, terms=frozenset({"thermal"}))
    assert not typical_heat(dynamics).kappa.any()
    assert typical_heat(virtual_arm(ur5e, 0)).kappa.all()


def test_warmth_shows_in_the_log(dynamics, day):
    hot = happening(dynamics, day, (), True)
    rng, sensors = np.random.default_rng, perfect_sensors(dynamics.arm)
    part = replace(day.trajectory, **{n: getattr(day.trajectory, n)[:6000] for n in "tqva"})
    warm, even = (observe(dynamics, part, sensors, rng(0), e) for e in (hot, ()))
    temperature = warm.channels["joint_temperatures"]
    assert np.all(np.diff(temperature, axis=0) >= -0.01) and np.all(temperature[-1] > 24.0)
    assert set(even.channels["joint_temperatures"].ravel()) == {35.0}
    more = np.abs(warm.channels["actual_current"][:600]).mean()
    assert more > np.abs(even.channels["actual_current"][:600]).mean()


def test_without_heat_a_log_is_as_it_always_was(ur5e):
    (one, truth), (two, same) = (simulate(ur5e, 3.0, 100.0, 4, heat=h) for h in (False, True))
    np.testing.assert_array_equal(one.channels["actual_q"], two.channels["actual_q"])
    assert truth["joints"] == same["joints"] and "course" not in truth
    assert {"t", "elbow_joint.temperature", "elbow_joint.viscous"} <= same["course"].keys()
