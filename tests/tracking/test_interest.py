"""What a belief means for the work."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.estimate import EKF
from urdyn.model.arm import load_arm, read_arm
from urdyn.report.track.interest import interest
from urdyn.signal import samples
from urdyn.tracking import Tracker
from urdyn.tracking.belief.interest import after, as_plain, gathered, nothing_yet, strained
from urdyn.tracking.belief.physical import KNOWN, quantities
from urdyn.tracking.belief.spare_payload import rest_of
from urdyn.types import NORMAL90, Gaussian


@pytest.fixture(scope="module")
def followed(workshop):
    """Every tenth reading of a run, and the tracker that made them."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    state, readings = tracker.init(), []
    for sample in samples(workshop.log):
        state, reading = tracker.step(state, sample)
        readings.append(reading)
    return tracker, [reading for reading in readings[::10] if reading is not None]


def gather(tracker, readings, taken=None):
    of, about = nothing_yet(6), quantities(tracker.fit, tracker.currents)
    about = about if taken is None else replace(about, taken=about.taken | taken)
    for reading in readings:
        of = strained(of, reading, tracker.currents)
        of = gathered(of, reading, about, tracker.model.prior.mean)
    return of


def centre(reading, tracker):
    """Of the load, (3,) [m] from the flange, and its mass [kg] as far as that is known."""
    at = tracker.currents.places["payload"].start
    load = quantities(tracker.fit, tracker.currents).payload(reading.belief)
    return load[0] * load[1:] / (load[0] ** 2 + reading.belief.cov[at, at])


def driven(tracker, x, u):
    """Torque for the load, and for the friction that rides on it."""
    load = tracker.currents.load(x, u)
    return load + np.exp(x[tracker.currents.places["beta"]]) * np.abs(load) * u.s


def test_the_spare_payload_takes_the_hardest_joint_to_its_limit(followed):
    tracker, readings = followed
    at, reference = tracker.currents.places, tracker.currents.reference
    tight = []
    for reading in readings:
        if reading.belief.sd[at["payload"]][0] >= KNOWN:
            continue
        of = gather(tracker, [reading])
        x, u = reading.belief.mean, reading.inputs
        heavier = x.copy()
        heavier[at["payload"]][:4] += of.spare * np.r_[1.0, centre(reading, tracker)]
        health, scale = np.exp(x[at["z"]]), np.exp(x[at["gain"]])
        torque = tracker.currents.observe(x, u) * reference.drive.gain * health
        torque += driven(tracker, heavier, u) - driven(tracker, x, u)
        limit = reference.arm.effort_limit * np.minimum(health, 1.0)
        tight.append(np.max(scale * np.abs(torque) / limit))
    assert len(tight) > 100
    np.testing.assert_allclose(tight, 1.0, rtol=1e-9)


def test_the_spare_payload_is_as_sure_as_the_belief(followed):
    """By finite differences in every state; the current's own noise left out."""
    tracker, readings = followed
    at = tracker.currents.places["payload"].start
    sure = [r for r in readings if r.belief.sd[at] < KNOWN]
    for reading in sure[::60]:
        nothing, cov = np.zeros(6), reading.belief.cov
        mean = reading.belief.mean.copy()
        mean[at : at + 4] = [1.0, 0.02, 0.03, 0.1]  # far from what cannot be
        quiet = replace(reading.inputs, noise=nothing, gripped=nothing, smeared=nothing)

        def margin(x, reading=reading, cov=cov, quiet=quiet):
            there = replace(reading, inputs=quiet, believed=lambda: Gaussian(x, cov))
            return gather(tracker, [there], {"payload": np.zeros(1)})

        n = tracker.currents.observe_jacobian(mean, quiet).shape[1]
        steps = np.eye(len(mean))[:n] * 1e-4
        slope = [(margin(mean + d).spare - margin(mean - d).spare) / 2e-4 for d in steps]
        by_belief = np.sqrt(slope @ cov[:n, :n] @ slope)
        assert margin(mean).spare_sd == pytest.approx(by_belief, rel=0.01)


def test_a_drive_whose_gain_is_uncertain_has_an_uncertain_margin(followed):
    tracker, readings = followed
    names = workshop_names(tracker)
    exact = as_plain(gather(tracker, readings, {"payload": np.zeros(1)}), names)["joints"]
    doubted = as_plain(gather(tracker, readings, {"payload": np.array([0.05])}), names)["joints"]
    for one, other in zip(exact, doubted, strict=True):
        used = 1.0 - other["torque_margin"]
        assert one["torque_margin"] == other["torque_margin"]
        np.testing.assert_allclose(
            other["torque_margin_sd"] ** 2 - one["torque_margin_sd"] ** 2, (0.05 * used) ** 2
        )


def test_a_load_that_may_be_nothing_has_its_centre_at_the_flange(followed):
    tracker, readings = followed
    at = tracker.currents.places["payload"].start
    reading = next(r for r in reversed(readings) if r.belief.sd[at] < KNOWN)
    spares = []
    for sds in (0.0, 0.5):
        mean, cov = reading.belief.mean.copy(), reading.belief.cov
        mean[at : at + 4] = 0.001, sds * reading.belief.sd[at + 1], 0.0, 0.0
        believed = Gaussian(mean, cov)
        about = replace(reading, believed=lambda believed=believed: believed)
        spares.append(gather(tracker, [about]).spare)
    assert spares[1] == pytest.approx(spares[0], rel=0.1)  # not at h / m, which is metres


def test_margins_are_those_of_the_hardest_moment(followed):
    tracker, readings = followed
    of, parts = gather(tracker, readings), [gather(tracker, [r]) for r in readings]
    np.testing.assert_array_equal(of.used, np.max([part.used for part in parts], axis=0))
    least = min(parts, key=lambda part: part.spare + NORMAL90 * part.spare_sd)
    assert (of.spare, of.spare_sd) == (least.spare, least.spare_sd)
    assert (of.used > 0.0).all() and (of.used < 1.0).all()


def test_of_two_margins_the_one_that_surely_is_less_counts(followed):
    """Not the one that seems to be less, but so vaguely that it may be far more."""
    tracker, readings = followed
    about = quantities(tracker.fit, tracker.currents)
    reading = replace(readings[100], widened=False)
    sure = gather(tracker, [reading])
    vague = replace(sure, spare=0.9 * sure.spare, spare_sd=sure.spare_sd + sure.spare)
    of = gathered(vague, reading, about, tracker.model.prior.mean)
    assert (of.spare, of.spare_sd) == (sure.spare, sure.spare_sd)


def test_noise_does_not_raise_what_is_used_of_a_drive(followed):
    """Where the belief tells the current as well as a sensor does, one wild sample is none."""
    tracker, readings = followed
    sure = Gaussian(readings[-1].belief.mean, 1e-9 * readings[-1].belief.cov)
    reading = replace(readings[-1], believed=lambda: sure)
    wild = replace(reading, current=3.0 * np.abs(reading.modelled) + 1.0)
    calm, of = (strained(nothing_yet(6), r, tracker.currents) for r in (reading, wild))
    np.testing.assert_array_equal(of.used, calm.used)
    per = tracker.currents.reference.drive.gain / tracker.currents.reference.arm.effort_limit
    np.testing.assert_allclose(of.used, np.abs(reading.modelled) * per, rtol=1e-12)


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


def test_peaks_tell_of_margins_but_their_rows_stand_for_no_others(followed):
    """Predictive error is that of rows at equal distances; a peak is unusual."""
    tracker, readings = followed
    of, about = nothing_yet(6), quantities(tracker.fit, tracker.currents)
    known = [replace(reading, widened=False) for reading in readings]
    for reading in known:
        of = after(of, reading, about, tracker.model.prior.mean, due=False)
    assert not of.samples.any() and not of.squares.any() and of.seconds == 0.0
    assert of.used.all() and of.spare_sd > 0.0


def test_who_has_learnt_nothing_errs_as_the_model_did_when_commissioned(workshop):
    """So that of the two errors only what was learnt makes one the smaller."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    untaught, of = tracker.init(), nothing_yet(6)
    about = quantities(tracker.fit, tracker.currents)
    for sample in samples(workshop.log.slice(0, 300)):
        state, reading = tracker.step(untaught, sample)
        untaught = replace(state, belief=untaught.belief)
        if reading is not None:
            of = gathered(of, reading, about, tracker.model.prior.mean)
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
    about = quantities(tracker.fit, tracker.currents)
    of = gathered(before, heavy, about, tracker.model.prior.mean)
    assert of.spare == gather(tracker, [heavy]).spare


def test_a_run_without_a_reading_says_so():
    of = as_plain(nothing_yet(2), ("one", "two"))
    assert of["payload_margin_kg"]["value"] is None
    assert of["joints"][0]["rre_percent"] is None and of["joints"][0]["rmse_A"] is None


@pytest.mark.parametrize(
    ("rest", "by", "least"),
    [
        (8.0, "rating", 8.0),
        (-1.0, "rating", -1.0),
        (30.0, "torque", 27.0),
        (np.inf, "torque", 27.0),
    ],
)
def test_the_payload_margin_ends_at_the_rating_where_drives_could_bear_more(rest, by, least):
    shown = replace(nothing_yet(2), spare=27.0, spare_sd=0.5)
    of = as_plain(shown, ("one", "two"), (rest, 0.1))
    sd = 0.1 if by == "rating" else 0.5
    assert of["payload_margin_kg"] == {"value": least, "sd": sd, "by": by}
    assert of["torque_payload_margin_kg"] == {"value": 27.0, "sd": 0.5}
    said = str(interest(of))
    words = (
        "than it is rated for" if least < 0.0 else "By its rating" if by == "rating" else "joints"
    )
    assert words in said


def test_a_rating_leaves_what_is_not_carried_of_it():
    load = {"payload.mass": {"mean": 7.7, "sd": 0.2}}
    arm = load_arm("ur16e")
    assert rest_of(arm, load, True) == (pytest.approx(8.3), 0.2)
    longer = (
        load_arm("ur5e")
        .urdf.replace("-0.425 0 0", "-0.625 0 0")
        .replace('name="ur5e"', 'name="own"')
    )
    assert rest_of(read_arm(longer), load, False)[0] == np.inf
    assert np.isnan(rest_of(arm, load, False)).all()


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
    about = quantities(tracker.fit, tracker.currents)
    lost = gathered(of, replace(anew, believed=lambda: vague), about, tracker.model.prior.mean)
    assert of.spare_sd > 0.0
    assert (lost.spare, lost.spare_sd) == (np.inf, 0.0)
