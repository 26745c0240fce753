"""Recordings that were low-passed are heard where they speak; others as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from urdyn.identify import identify, validate
from urdyn.identify.band import EVERYTHING, Band, common_band
from urdyn.io import Effort, read
from urdyn.model.arm import load_arm
from urdyn.signal import condition
from urdyn.simulate import simulate
from urdyn.types import Log

CUT = 3.0  # [Hz]


@pytest.fixture(scope="module")
def ur10():
    return load_arm("ur10")


@pytest.fixture(scope="module")
def log(ur5e) -> Log:
    return simulate(ur5e, 20.0, 125.0, 5)[0]


def low_passed(log: Log) -> Log:
    sos = butter(8, CUT, fs=125.0, output="sos")
    names = ("actual_q", "actual_qd", "actual_current")
    channels = {name: sosfiltfilt(sos, log.channels[name], axis=0) for name in names}
    return replace(log, channels=channels)


def test_a_robot_s_own_stream_is_taken_whole(log):
    assert common_band([condition(log)]) is EVERYTHING
    assert common_band([condition(low_passed(log)), condition(log)]) is EVERYTHING


def test_a_filtered_recording_is_heard_below_the_cut(log):
    band = common_band([condition(low_passed(log))])
    # Of the eighth order, and passed twice, the filter leaves a thousandth at 1.54 times its cut.
    assert 0.5 * CUT < band.edge * 62.5 < 1.6 * CUT
    assert 1.0 / band.every > band.edge


def test_both_sides_of_an_equation_stay_equal():
    rng = np.random.default_rng(2)
    A, x = rng.standard_normal((500, 7)), rng.standard_normal(7)
    band = Band(5, 0.15)
    np.testing.assert_allclose(band(A) @ x, band(A @ x), atol=1e-12)
    assert len(band(A)) == 100 and band(A).std() < 0.6 * A.std()
    assert EVERYTHING(A) is A


@pytest.mark.slow
def test_a_filtered_recording_is_identified_as_well_as_it_can_be(ur5e, log):
    held_out = low_passed(log).slice(1500)
    score = validate(identify(ur5e, condition(low_passed(log).slice(0, 1500))), held_out)
    whole = validate(identify(ur5e, condition(log.slice(0, 1500))), held_out)
    # Most of what is left is friction's edges, which the filter took from the current alone.
    assert (score.rmse < 1.25 * whole.rmse + 0.01).all()


@pytest.mark.slow
def test_a_real_filtered_bag_is_predicted(recordings, ur10):
    path = recordings / "ur10_dynamics_bag" / "ur10_exciting_trajectory.db3"
    gain = np.array([13.5841, 14.2959, 11.3716, 11.2408, 11.7681, 11.7682])
    log = read(path, effort=Effort("Nm", gain))
    fit = identify(ur10, condition(log.slice(0, 2064)), gain=gain)
    drive = fit.dynamics.drive
    assert (drive.coulomb + drive.stribeck > -1e-6).all()
    assert (validate(fit, log.slice(2064)).rmse <= [0.09, 0.10, 0.13, 0.06, 0.05, 0.14]).all()
