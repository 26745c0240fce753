"""Statistics of sensors as recordings show them, and of what recorders do to their samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import Arm
from urdyn.simulate import (
    POLLING,
    SEVERAL_RATES,
    fourier,
    happening,
    observe,
    real_sensors,
    simulate,
    virtual_arm,
)
from urdyn.simulate.noise import Band, banded
from urdyn.simulate.recorder import Recorder
from urdyn.simulate.sensors import COLOUR
from urdyn.simulate.watched import watched
from urdyn.simulate.work import Work

RATES = (20.0, 94.0, 500.0)


def correlation(lag: float) -> np.ndarray:
    """Of the noise asked for, at a lag [s], by joint."""
    return sum(
        np.array(share) * np.exp(-lag / time) * np.cos(2.0 * np.pi * frequency * lag)
        for (time, frequency), share in COLOUR.items()
    )


@pytest.mark.parametrize("rate", RATES)
def test_noise_has_the_colour_asked_for_at_any_rate(ur10e: Arm, rate):
    sensors = real_sensors(ur10e)
    n = round(1500.0 * rate)
    noise = banded(np.random.default_rng(0), n, sensors.current_noise, sensors.bands, 1.0 / rate)
    score = noise / sensors.current_noise
    # Bartlett: the variance of a sample autocovariance is at most 2 sum rho² / n over all lags.
    lags = np.arange(-5000, 5001) / rate
    rho = np.array([correlation(abs(lag)) for lag in lags]) + (lags == 0)[:, None] * (
        1.0 - correlation(0.0)
    )
    five = 5.0 * np.sqrt(2.0 * (rho**2).sum(axis=0) / n)
    assert np.all(np.abs((score**2).mean(axis=0) - 1.0) < five)
    for lag in (1, 2, 5, 20):
        found = (score[lag:] * score[:-lag]).mean(axis=0)
        assert np.all(np.abs(found - correlation(lag / rate)) < five), lag


def test_a_band_is_an_autoregression_whose_innovations_are_white():
    band = Band(0.05, np.ones(1))
    noise = banded(np.random.default_rng(1), 100_000, np.ones(1), (band,), 0.01)[:, 0]
    innovation = noise[1:] - np.exp(-0.2) * noise[:-1]
    lagged = (innovation[1:] * innovation[:-1]).mean() / innovation.var()
    assert abs(lagged) < 5.0 / np.sqrt(len(innovation))
    assert innovation.var() == pytest.approx(1.0 - np.exp(-0.4), rel=5 * np.sqrt(2 / 1e5))


def test_shares_of_the_colour_leave_the_variance_to_be_one():
    shares = sum(np.array(share) for share in COLOUR.values())
    assert np.all((shares >= 0.0) & (shares <= 1.0))


def test_temperature_comes_in_sixteenths(ur10e: Arm):
    dynamics = virtual_arm(ur10e, 1)
    made = fourier(ur10e, 120.0, 20.0, np.random.default_rng(0))
    events = happening(dynamics, Work(made), (), True)
    log = observe(dynamics, made, real_sensors(ur10e), np.random.default_rng(0), events)
    sixteenths = 16.0 * log.channels["joint_temperatures"]
    np.testing.assert_array_equal(sixteenths, np.round(sixteenths))
    assert len(np.unique(sixteenths[:, 0])) > 5


def test_white_noise_stays_the_default(ur10e: Arm):
    log, truth = simulate(ur10e, 2.0, 100.0, 0)
    assert truth["noise"]["colour"] == 0.0 and "actual_TCP_force" not in log


def test_an_exact_recorder_changes_nothing(ur10e: Arm):
    log, _ = simulate(ur10e, 2.0, 100.0, 0)
    same = Recorder().record(log, np.random.default_rng(0))
    np.testing.assert_array_equal(same.t, log.t)
    for name in log.channels:
        np.testing.assert_array_equal(same.channels[name], log.channels[name])


def test_a_polling_recorder_repeats_and_skips_as_many_rows_as_real_ones(ur10e: Arm):
    log, _ = simulate(ur10e, 30.0, 500.0, 0)
    polled = POLLING.record(log, np.random.default_rng(0))
    steps = np.round(np.diff(polled.t) / 0.002)
    assert 0.08 < np.mean(steps != 1.0) < 0.17
    assert np.any(steps == 0.0) and np.any(steps == 2.0) and np.all(steps >= 0.0)


def test_a_torn_row_is_made_of_two_neighbours(ur10e: Arm):
    log, _ = simulate(ur10e, 4.0, 500.0, 0)
    torn = Recorder(torn=0.5).record(log, np.random.default_rng(0))
    np.testing.assert_array_equal(torn.t, log.t)
    pairs = [(torn.channels[n], log.channels[n]) for n in log.channels if log.channels[n].ndim > 1]
    whole = np.array([(one == other).all(axis=1) for one, other in pairs])
    later = np.array([(one[:-1] == other[1:]).all(axis=1) for one, other in pairs])
    assert (whole[:, :-1] | later).all() and whole[0].all()
    assert 0.3 < np.mean(~whole.all(axis=0)) < 0.6


def test_slow_channels_speak_at_their_rate(ur10e: Arm):
    sensors = replace(real_sensors(ur10e), bands=())
    log, _ = simulate(ur10e, 4.0, 500.0, 0, sensors=sensors)
    sparse = SEVERAL_RATES.record(log, np.random.default_rng(0))
    for name, rate in SEVERAL_RATES.rates.items():
        told = np.isfinite(sparse.channels[name]).all(axis=1)
        assert told.sum() == 4.0 * rate
        np.testing.assert_array_equal(sparse.channels[name][told], log.channels[name][told])
    np.testing.assert_array_equal(sparse.channels["actual_q"], log.channels["actual_q"])


@pytest.mark.parametrize("rate", [100.0, 70.0, 60.0, 0.5])
def test_a_tracker_measures_at_the_rate_it_is_asked_for(ur10e: Arm, rate):
    t = np.arange(1000) / 100.0
    seen = watched(virtual_arm(ur10e, 1), t, np.zeros((1000, 6)), rate, np.random.default_rng(0))
    assert len(seen) == 10.0 * rate and np.isin(seen.t, t).all()
    assert np.abs(seen.t - np.arange(len(seen)) / rate).max() < 0.01


def test_lost_samples_are_gone(ur10e: Arm):
    log, _ = simulate(ur10e, 20.0, 500.0, 0)
    left = Recorder(lost=0.1).record(log, np.random.default_rng(0))
    assert np.all(np.diff(left.t) > 0.0)
    assert len(left) / len(log) == pytest.approx(0.9, abs=5.0 * np.sqrt(0.09 / len(log)))
