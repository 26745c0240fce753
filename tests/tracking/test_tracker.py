"""A twin at work on virtual arms: honest where nothing changes, quick where something does."""

from functools import lru_cache

import numpy as np
import pytest

from urdyn.estimate import EKF, UKF
from urdyn.identify import identify
from urdyn.model.arm import load_arm
from urdyn.signal import condition, samples
from urdyn.simulate import fourier, observe, parse_fault, typical_sensors, virtual_arm
from urdyn.tracking import Drift, Tracker, quantities

RATE = 100.0


@lru_cache
def commissioned(seed):
    """A virtual arm, what it asks of a run, and what identification made of a first run."""
    arm = load_arm("ur10e")
    dynamics = virtual_arm(arm, seed)
    log = run(dynamics, seed, 0, 25.0)
    return dynamics, identify(arm, condition(log), gain=dynamics.drive.gain)


def run(dynamics, seed, number, duration, *faults):
    streams = [np.random.default_rng([seed, number, k]) for k in range(2)]
    asked = fourier(dynamics.arm, duration, RATE, streams[0])
    events = [parse_fault(fault, 6) for fault in faults]
    return observe(dynamics, asked, typical_sensors(dynamics.arm), streams[1], events)


def tracked(fit, log, filter_, drift=None):
    """Readings of a whole log, and the quantities that their beliefs stand for."""
    tracker = Tracker(fit, filter_, 1.0 / RATE, drift)
    state, readings = tracker.init(), []
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is not None:
            readings.append(reading)
    return readings, quantities(fit, tracker.currents)


@pytest.mark.parametrize("filter_", [EKF(), UKF(alpha=0.17)], ids=["ekf", "ukf"])
def test_a_healthy_arm_stays_what_it_is(filter_):
    dynamics, fit = commissioned(0)
    readings, physical = tracked(fit, run(dynamics, 0, 1, 20.0), filter_)
    assert not any(reading.widened for reading in readings)
    mean, sd = physical.of(readings[-1].belief)
    for field in ("coulomb", "viscous"):
        at = [physical.names.index(f"{j}.{field}") for j in dynamics.arm.joint_names]
        z = (mean[at] - getattr(dynamics.drive, field)) / sd[at]
        assert np.sum(z**2) < 22.5  # chi-square of six, once in a thousand
    told = [r.innovation for r in readings[200:] if r.innovation.measured]
    nis = np.array([innovation.nis / innovation.measured for innovation in told])
    # Six joints and some 1800 readings: the mean of chi-square over its degrees is known to 1 %;
    # doubt about presliding makes the filter expect a little more than there is.
    assert 0.75 < nis.mean() < 1.1
    assert (np.linalg.eigvalsh(readings[-1].belief.cov) > 0.0).all()


def test_friction_that_grows_is_followed_and_others_stay():
    dynamics, fit = commissioned(1)
    log = run(dynamics, 1, 1, 40.0, "friction_increase:joint=2,onset=10,rate=0.01")
    # A third in half a minute is far more than an arm's wear, so rates are told to be large.
    readings, physical = tracked(fit, log, EKF(), Drift(rate_sd=1e-3, acceleration=1e-3))
    mean, sd = physical.of(readings[-1].belief)
    at = [physical.names.index(f"{j}.coulomb") for j in dynamics.arm.joint_names]
    grown = dynamics.drive.coulomb * np.where(np.arange(6) == 2, 1.3, 1.0)
    assert abs(mean[at][2] / grown[2] - 1.0) < 0.05
    others = [0, 1, 3, 4, 5]
    z = (mean[at] - grown)[others] / sd[at][others]
    assert np.sum(z**2) < 25.0


def test_a_payload_that_is_picked_up_is_weighed():
    dynamics, fit = commissioned(0)
    log = run(dynamics, 0, 2, 24.0, "payload_change:mass=2.5,com=0/0/0.08,onset=10")
    readings, physical = tracked(fit, log, EKF())
    changes = [reading.t for reading in readings if reading.widened]
    assert changes and 10.0 < changes[0] < 11.5
    at = physical.names.index("payload.mass")
    later = next(reading for reading in readings if reading.t > 15.0)
    for reading in (later, readings[-1]):
        mean, sd = physical.of(reading.belief)
        assert abs(mean[at] - 2.5) < max(0.03 * 2.5, 3.0 * sd[at])


def test_gaps_and_nonsense_do_not_derail_it():
    from dataclasses import replace

    dynamics, fit = commissioned(0)
    log = run(dynamics, 0, 3, 12.0)
    current = log.joint("actual_current").copy()
    current[300:340] = np.nan
    current[500] = 1e6
    broken = replace(log, channels={**log.channels, "actual_current": current})
    kept = np.r_[0:700, 900:1200]
    broken = replace(
        broken, t=log.t[kept], channels={k: v[kept] for k, v in broken.channels.items()}
    )
    readings, physical = tracked(fit, broken, EKF())
    mean, sd = physical.of(readings[-1].belief)
    assert np.isfinite(mean).all() and (sd > 0.0).all()
    at = [physical.names.index(f"{j}.viscous") for j in dynamics.arm.joint_names]
    assert (np.abs(mean[at] / dynamics.drive.viscous - 1.0) < 0.2).all()


@pytest.mark.slow
def test_intervals_hold_after_a_minute():
    z, masses = [], []
    for seed in range(8):
        dynamics, fit = commissioned(seed)
        readings, physical = tracked(fit, run(dynamics, seed, 1, 60.0), EKF())
        mean, sd = physical.of(readings[-1].belief)
        for field in ("coulomb", "viscous"):
            at = [physical.names.index(f"{j}.{field}") for j in dynamics.arm.joint_names]
            z.append((mean[at] - getattr(dynamics.drive, field)) / sd[at])
        at = [physical.names.index(f"{link}.mass") for link in dynamics.arm.link_names]
        masses.append((mean[at] - dynamics.inertials[:, 0]) / sd[at])
    for scores in (z, masses):
        inside = np.abs(np.concatenate(scores)) < 1.645
        # Binomial, three standard deviations around nine in ten.
        assert abs(inside.mean() - 0.9) < 3.0 * np.sqrt(0.09 / inside.size) + 0.03
