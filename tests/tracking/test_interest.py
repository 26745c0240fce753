"""What a belief means for the work."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import Tracker
from urdyn.tracking.interest import _doubt, as_plain, gathered, nothing_yet, strained
from urdyn.tracking.physical import KNOWN
from urdyn.types import Gaussian


@pytest.fixture(scope="module")
def followed(workshop):
    """Every tenth reading of a run, and the tracker that made them."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    state, readings = tracker.init(), []
    for sample in samples(workshop.log):
        state, reading = tracker.step(state, sample)
        readings.append(reading)
    return tracker, [reading for reading in readings[::10] if reading is not None]


def gather(tracker, readings):
    of = nothing_yet(6)
    for reading in readings:
        of = strained(of, reading, tracker.currents)
        of = gathered(of, reading, tracker.currents, tracker.model.prior.mean)
    return of


def driven(tracker, x, u):
    """Torque for the load, and for the friction that rides on it."""
    load = tracker.currents.load(x, u)
    return load + np.exp(x[tracker.currents.places["beta"]]) * np.abs(load) * u.s


def test_the_spare_payload_takes_the_hardest_joint_to_its_limit(followed):
    tracker, readings = followed
    at, reference = tracker.currents.places["payload"], tracker.currents.reference
    tight = []
    for reading in readings:
        if reading.belief.sd[at][0] >= KNOWN:
            continue
        of = gather(tracker, [reading])
        x, u = reading.belief.mean, reading.inputs
        heavier = x.copy()
        heavier[at.start] += of.spare  # at the flange: what is carried has no centre of mass
        health = np.exp(x[tracker.currents.places["z"]])
        torque = tracker.currents.observe(x, u) * reference.drive.gain * health
        torque += driven(tracker, heavier, u) - driven(tracker, x, u)
        limit = reference.arm.effort_limit * np.minimum(health, 1.0)
        tight.append(np.max(np.abs(torque) / limit))
    assert len(tight) > 100
    np.testing.assert_allclose(tight, 1.0, rtol=1e-9)


def test_the_spare_payload_is_as_sure_as_the_current_of_the_hardest_joint(followed):
    """By a finite difference: offsets of friction move the currents, and with them what is left."""
    tracker, readings = followed
    sure = [r for r in readings if r.belief.sd[tracker.currents.places["payload"]][0] < KNOWN]
    for reading in sure[::20]:
        of, x, u = gather(tracker, [reading]), reading.belief.mean, reading.inputs
        slope = np.zeros(6)
        for j in range(6):
            moved = x.copy()
            moved[tracker.currents.places["o"]][j] += 1e-4
            shifted = Gaussian(moved, reading.belief.cov)
            there = replace(reading, believed=lambda shifted=shifted: shifted)
            more = (tracker.currents.observe(moved, u) - tracker.currents.observe(x, u))[j]
            slope[j] = (gather(tracker, [there]).spare - of.spare) / more
        assert np.count_nonzero(slope) == 1  # of the hardest one
        assert of.spare_sd == pytest.approx(np.abs(slope) @ _doubt(reading, tracker.currents))


def test_margins_are_those_of_the_hardest_moment(followed):
    tracker, readings = followed
    of, parts = gather(tracker, readings), [gather(tracker, [r]) for r in readings]
    np.testing.assert_array_equal(of.used, np.max([part.used for part in parts], axis=0))
    assert of.spare == min(part.spare for part in parts)
    assert (of.used > 0.0).all() and (of.used < 1.0).all()


def test_friction_takes_what_the_drives_give_and_motion_does_not_keep(followed):
    tracker, readings = followed
    of = gather(tracker, readings)
    power = np.array(
        [r.predicted * tracker.currents.reference.drive.gain * r.inputs.v for r in readings]
    )
    net = np.nansum(np.nan_to_num(power)[1:] * np.diff([r.t for r in readings])[:, None])
    assert (of.lost > 0.0).all()
    # What was put in and did not come back, but for what the arm holds at the end and the quarter
    # of a second by which ten samples blur fast power.
    assert of.lost.sum() == pytest.approx(net, rel=0.15)


def test_residuals_are_those_of_the_readings(followed):
    tracker, readings = followed
    joints = as_plain(gather(tracker, readings), workshop_names(tracker))["joints"]
    compared = [np.isfinite(r.innovation.residual) for r in readings]
    residual = np.where(compared, [r.current - r.modelled for r in readings], np.nan)
    rmse = np.sqrt(np.nanmean(residual**2, axis=0))
    np.testing.assert_allclose([joint["rmse_A"] for joint in joints], rmse, rtol=1e-12)


def test_who_has_learnt_nothing_errs_as_the_model_did_when_commissioned(workshop):
    """So that of the two errors only what was learnt makes one the smaller."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    untaught, of = tracker.init(), nothing_yet(6)
    for sample in samples(workshop.log.slice(0, 300)):
        state, reading = tracker.step(untaught, sample)
        untaught = replace(state, belief=untaught.belief)
        if reading is not None:
            of = gathered(of, reading, tracker.currents, tracker.model.prior.mean)
    assert (of.samples > 100).all()
    np.testing.assert_allclose(of.squares[0], of.squares[1], rtol=1e-9)


def test_an_arm_that_tells_no_rated_torque_has_no_end_to_its_margin(followed):
    tracker, readings = followed
    dynamics = tracker.fit.dynamics
    arm = replace(dynamics.arm, effort_limit=np.full(6, np.inf))
    unrated = replace(tracker, fit=replace(tracker.fit, dynamics=replace(dynamics, arm=arm)))
    of = gather(unrated, readings[::10])
    assert of.spare == np.inf and not of.used.any()


def test_another_payload_has_another_margin(followed):
    tracker, readings = followed
    light, heavy = readings[100], replace(readings[50], widened=True)
    before = gather(tracker, [light])
    of = gathered(before, heavy, tracker.currents, tracker.model.prior.mean)
    assert of.spare == gather(tracker, [heavy]).spare


def test_a_run_without_a_reading_says_so():
    of = as_plain(nothing_yet(2), ("one", "two"))
    assert of["payload_margin_kg"]["value"] is None
    assert of["joints"][0]["rre_percent"] is None and of["joints"][0]["rmse_A"] is None


def workshop_names(tracker):
    return tracker.fit.dynamics.arm.joint_names


def test_where_nobody_knows_what_is_carried_the_torque_is_the_measured_one(followed):
    tracker, readings = followed
    unknown = [r for r in readings if r.belief.sd[tracker.currents.places["payload"]][0] > 1.0]
    assert unknown
    for reading in unknown:
        of = strained(nothing_yet(6), reading, tracker.currents)
        noise = np.sqrt(np.diag(tracker.currents.observe_cov(reading.inputs)))
        per = tracker.currents.reference.drive.gain / tracker.currents.reference.arm.effort_limit
        assert (of.used_sd <= np.sqrt(2.0) * noise * per * (1 + 1e-9)).all()
        measured = of.used_sd == noise * per
        np.testing.assert_allclose(of.used[measured], np.abs(reading.current * per)[measured])


def test_where_nobody_knows_what_is_carried_a_peak_counts_though_less_was_foreseen(followed):
    tracker, (reading, *_) = followed
    known = strained(nothing_yet(6), reading, tracker.currents)
    reference = tracker.currents.reference
    most = known.used * reference.arm.effort_limit / reference.drive.gain
    vague = Gaussian(reading.belief.mean, 1e4 * reading.belief.cov)
    less = replace(reading, current=2.0 * most, modelled=0.5 * most, believed=lambda: vague)
    np.testing.assert_allclose(strained(known, less, tracker.currents).used, 2.0 * known.used)


def test_of_a_margin_that_is_not_known_no_earlier_payload_tells_how_well(followed):
    tracker, readings = followed
    of, anew = gather(tracker, readings), replace(readings[-1], widened=True)
    vague = Gaussian(anew.belief.mean, 1e4 * anew.belief.cov)
    lost = gathered(
        of, replace(anew, believed=lambda: vague), tracker.currents, tracker.model.prior.mean
    )
    assert of.spare_sd > 0.0
    assert (lost.spare, lost.spare_sd) == (np.inf, 0.0)
