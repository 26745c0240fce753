"""Warm joints: a warm-up is no wear, with the joints' temperatures told."""

from dataclasses import replace

import numpy as np
import pytest
from workshop import commissioned

from urdyn.estimate import EKF
from urdyn.identify import identify
from urdyn.model.arm import load_arm
from urdyn.model.population import KAPPA
from urdyn.signal import condition, samples
from urdyn.simulate import (
    fourier,
    observe,
    typical_heat,
    typical_sensors,
    virtual_arm,
    warm_up,
)
from urdyn.tracking import Tracker, quantities
from urdyn.tracking.belief.model import LAG
from urdyn.tracking.step.warmth import warmed

RATE = 20.0


def test_a_lubricant_follows_its_joint():
    joint, lubricant = np.array([30.0, 40.0]), np.array([28.0, 40.0])
    once = warmed(lubricant, joint, LAG)
    np.testing.assert_allclose(once, [30.0 - 2.0 * np.exp(-1.0), 40.0])
    np.testing.assert_allclose(warmed(warmed(lubricant, joint, 100.0), joint, LAG - 100.0), once)


def test_joints_tell_how_long_a_robot_was_off_whose_clock_restarted_with_it():
    """By its stamps a minute; by then a cold joint's lubricant is as cold, a warm one's as warm."""
    before, joint, minute = np.full(2, 40.0), np.array([14.0, 39.5]), 60.0
    cold, warm = warmed(before, joint, minute)
    assert KAPPA * (cold - 14.0) < 0.01  # of viscous friction, which was 0.3
    np.testing.assert_allclose(warm, 39.5 + 0.5 * np.exp(-minute / LAG))


def test_a_joint_at_work_outruns_its_lubricant_as_far_as_physics_has_it():
    """An arm that was just switched on is warmed by the most: its stamps tell the time."""
    dynamics = virtual_arm(load_arm("ur5e"), 1)
    heat = typical_heat(dynamics)
    power = np.full((1800, 6), 15.0) / heat.resistance  # to 15 K above the room
    joint, lubricant = heat.follow(power, np.full(1800, 22.0), heat.cold)
    told = lubricant[0]
    for now in joint[1:]:
        told = warmed(told, now, 1.0)
    np.testing.assert_allclose(told, lubricant[-1], atol=0.02)


def test_nobody_knows_a_lubricant_before_its_joint():
    unknown, joint = np.full(2, np.nan), np.array([np.nan, 31.0])
    np.testing.assert_array_equal(warmed(unknown, joint, 1.0), joint)
    known = np.array([25.0, 25.0])
    np.testing.assert_array_equal(warmed(known, np.full(2, np.nan), 1.0), known)


@pytest.mark.parametrize("later", [60.0, 36000.0, -5.0])
def test_a_joint_that_cools_in_a_gap_is_cold_after_it_and_so_is_one_whose_clock_was_set_back(
    workshop, later
):
    """Every drift of a night is too much; all of its cooling is not."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    state, told = tracker.init(), list(samples(workshop.log.slice(0, 60)))
    for sample in told:
        state, _ = tracker.step(state, replace(sample, temperature=np.full(6, 45.0)))
    np.testing.assert_array_equal(state.joints.lubricant, 45.0)
    for sample in told:
        cold = replace(sample, t=sample.t + later, temperature=np.full(6, 22.0))
        state, _ = tracker.step(state, cold)
    np.testing.assert_allclose(state.joints.lubricant, 22.0, atol=0.1)


def shift(duration):
    """A cold arm at work, and its commissioned model."""
    dynamics, fit = commissioned(0)
    motion, noise = (np.random.default_rng([5, k]) for k in range(2))
    work = fourier(dynamics.arm, duration, RATE, motion)
    heat = warm_up(dynamics, work, typical_heat(dynamics))
    return dynamics, fit, observe(dynamics, work, typical_sensors(dynamics.arm), noise, (heat,))


def test_friction_is_quoted_at_the_temperature_it_was_found_at():
    """Commissioned in a cold hall: the same arm an hour later, as cold, is no other.

    Where nobody measured the temperature on the first day, later ones say nothing of friction.
    """
    dynamics, cold, rate = virtual_arm(load_arm("ur10e"), 0), 21.0, 50.0
    sensors = replace(typical_sensors(dynamics.arm), temperature=cold)
    first, later = (
        observe(dynamics, fourier(dynamics.arm, 20.0, rate, rng), sensors, rng)
        for rng in (np.random.default_rng([6, k]) for k in range(2))
    )
    felt = np.where(np.arange(6) < 4, first.joint("joint_temperatures"), np.nan)
    first = replace(first, channels=dict(first.channels) | {"joint_temperatures": felt})
    fit = identify(dynamics.arm, condition(first), gain=dynamics.drive.gain)
    np.testing.assert_allclose(fit.dynamics.drive.temperature, felt[0], rtol=1e-12)
    tracker = Tracker(fit, EKF(), 1.0 / rate)
    state = tracker.init()
    for sample in samples(later):
        state, reading = tracker.step(state, sample)
    np.testing.assert_array_equal(reading.inputs.felt, np.arange(6) < 4)
    at, prior = tracker.currents.places, tracker.model.prior
    for group in ("alpha", "kappa"):
        moved = (reading.belief.mean - prior.mean)[at[group]] / prior.sd[at[group]]
        assert np.abs(moved).max() < 3.5, group  # the 14 K to a typical 35 °C would be 50


def followed(fit, log):
    """Beliefs along a log, five of them."""
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state, beliefs = tracker.init(), []
    for k, sample in enumerate(samples(log)):
        state, reading = tracker.step(state, sample)
        if reading is not None and k % (len(log) // 5) == len(log) // 5 - 10:
            beliefs.append(reading.belief)
    return quantities(fit, tracker.currents), beliefs


@pytest.mark.slow
def test_a_warm_up_is_not_read_as_wear():
    dynamics, fit, log = shift(600.0)
    told = log.joint("joint_temperatures")
    assert np.ptp(told, axis=0).max() > 6.0  # soft enough for friction to fall by a tenth
    of, beliefs = followed(fit, log)
    for field in ("coulomb", "viscous"):
        at = [of.names.index(f"{joint}.{field}") for joint in dynamics.arm.joint_names]
        truth = getattr(dynamics.drive, field)
        for belief in beliefs:
            assert np.linalg.eigvalsh(belief.cov)[0] > 0.0
            mean, sd = of.of(belief)
            assert np.sum(((mean[at] - truth) / sd[at]) ** 2) < 22.5  # once in a thousand
            np.testing.assert_allclose(mean[at], truth, rtol=0.03)


def test_without_temperatures_nothing_is_claimed_of_them():
    _, fit, log = shift(15.0)
    silent = {k: v for k, v in log.channels.items() if k != "joint_temperatures"}
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state = tracker.init()
    for sample in samples(replace(log, channels=silent)):
        state, reading = tracker.step(state, sample)
    assert np.isnan(state.joints.lubricant).all() and reading.inputs.blind
    at = tracker.currents.places["kappa"]
    np.testing.assert_allclose(reading.belief.sd[at], tracker.model.prior.sd[at], rtol=0.05)
