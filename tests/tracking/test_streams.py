"""An arm at work with a tracker beside it, and a sensor at its flange: each told when it tells."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from workshop import RATE, commissioned

from urdyn.dbn.measurement import LinearMeasurement, Standing
from urdyn.estimate import EKF
from urdyn.identify.kinematics.spread import geometry_spread
from urdyn.model.geometry.drawing import drawing_of, redrawn
from urdyn.signal import Instant, samples
from urdyn.simulate import fourier, observe, parse_fault, typical_sensors, virtual_arm
from urdyn.simulate.observe import log_and_links
from urdyn.simulate.payload import Payload
from urdyn.simulate.watched import watched
from urdyn.simulate.work import pick_and_place
from urdyn.tracking import QUICKER, Drift, Tracker, quantities
from urdyn.tracking.streams.of_source import WATCHED, pose_stream
from urdyn.tracking.streams.wrench_stream import ANEW_TOUCHING, WrenchStream
from urdyn.types import Gaussian

SLIP, ONSET, JOINT = 0.02, 14.0, 1
SLOW = 20.0  # [Hz]


@lru_cache
def life():
    """18 s of an arm that is not as drawn, whose encoder slips, and what a tracker sees of it."""
    dynamics, fit = commissioned(0)
    form = drawing_of(dynamics.arm).form
    off = geometry_spread(form) * np.random.default_rng(3).standard_normal(22)
    built = replace(dynamics, arm=redrawn(dynamics.arm, form.table(off)))
    ways = [np.random.default_rng([0, 5, k]) for k in range(3)]
    asked = fourier(built.arm, 18.0, RATE, ways[0])
    events = [parse_fault(f"encoder_offset:joint={JOINT},offset={SLIP},onset={ONSET}", 6)]
    log, links = log_and_links(built, asked, typical_sensors(built.arm), ways[1], events)
    seen = watched(built, log.t, links, 5.0, ways[2])
    poses = np.column_stack([seen.t, *seen.channels.values()])
    return fit, off, log, poses


def listened(tracker, log, beside=None, every=None):
    """State after a log; `beside` says what comes with a sample since the stamp before it."""
    state, before, readings = tracker.init(), -np.inf, []
    for sample in samples(log):
        if beside:
            sample = replace(sample, beside=beside(before, sample))
        before = sample.t
        state, reading = tracker.step(state, sample)
        if reading is not None and every and every(reading):
            readings.append(reading)
    return state, readings


def by_tracker(poses):
    return lambda before, now: {"pose": poses[(poses[:, 0] > before) & (poses[:, 0] <= now.t)]}


@pytest.mark.parametrize(
    "filter_",
    [pytest.param(EKF(), marks=pytest.mark.slow, id="full"), QUICKER["realtime"]],
)
def test_a_tracker_sees_geometry_and_the_slip_of_an_encoder(filter_):
    fit, off, log, poses = life()
    stream = pose_stream(fit.dynamics.arm, False)
    tracker = Tracker(fit, filter_, 1.0 / RATE, WATCHED, streams=(stream,))

    def looked_at(reading):
        return any(abs(reading.t - t) < 0.5 / RATE for t in (ONSET - 0.5, ONSET + 1.5))

    state, (before, soon) = listened(tracker, log, by_tracker(poses), looked_at)
    at = tracker.currents.places["k"]
    slipped = np.where(np.arange(6) == JOINT, -SLIP, 0.0)
    for reading, truth in ((before, np.zeros(6)), (soon, slipped)):
        zero, sd = reading.belief.mean[at], reading.belief.sd[at]
        assert (np.abs(zero - truth) < 1.645 * sd).all()
        assert sd[JOINT] < 1e-3
    mean, sd = tracker.estimates_beside(state)
    assert np.sum(((mean[:22] - off) / sd[:22]) ** 2) < 48.3  # chi-square of 22, once in a thousand
    of = quantities(fit, tracker.currents, tracker.beside)
    told = of.of(tracker.filter.belief(state.belief), (mean, sd))
    assert len(told[0]) == len(of.names) == len(of.units)
    assert told[0][of.names.index("kinematics.elbow_joint.a")] == mean[stream.names.index(
        "kinematics.elbow_joint.a"
    )]  # fmt: skip


def test_the_controllers_pose_moves_nothing_that_currents_tell():
    fit, off, log, _ = life()
    log = log.slice(0, 700)
    own = Tracker(fit, EKF(), 1.0 / RATE, streams=(pose_stream(fit.dynamics.arm, True),))
    alone = Tracker(fit, EKF(), 1.0 / RATE)
    state, without = listened(own, log)[0], listened(alone, log)[0]
    np.testing.assert_array_equal(state.belief.mean, without.belief.mean)
    np.testing.assert_array_equal(state.belief.cov, without.belief.cov)
    mean, sd = own.estimates_beside(state)
    assert np.sum(((mean[:22] - off) / sd[:22]) ** 2) < 48.3


def test_gravity_says_nothing_of_zeros_that_it_does_not_load():
    """Intervals of the base and of the last joint stay; those of the next two shrink."""
    fit, _, log, _ = life()
    tracker = Tracker(fit, EKF(), 1.0 / RATE, Drift(zero=0.0, zero_memory=np.inf))
    before = tracker.model.prior.sd[tracker.currents.places["k"]]
    state, _ = listened(tracker, log.slice(0, 1000))
    after = tracker.filter.belief(state.belief).sd[tracker.currents.places["k"]]
    print(after / before)
    assert (after[[0, 5]] > 0.999 * before[[0, 5]]).all()
    assert (after[[1, 2]] < 0.999 * before[[1, 2]]).all()


@lru_cache
def weighed():
    """14 s of an arm that takes 2.5 kg up after seven, with a sensor at its flange.

    Also what its currents alone tell of the payload just before and at the end, mean and sd.
    """
    dynamics, fit = commissioned(0)
    ways = [np.random.default_rng([0, 6, k]) for k in range(2)]
    asked = fourier(dynamics.arm, 14.0, RATE, ways[0])
    events = [parse_fault("payload_change:mass=2.5,com=0/0/0.08,onset=7", 6)]
    sensors = replace(typical_sensors(dynamics.arm), wrench_noise=(1.0, 0.02))
    log = observe(dynamics, asked, sensors, ways[1], events)
    return fit, log, masses(Tracker(fit, EKF(), 1.0 / RATE), log)


def masses(tracker, log, beside=None):
    """Mean and sd (2, 2) of the payload's mass [kg], before and after the change."""
    of = quantities(tracker.fit, tracker.currents)
    at = of.names.index("payload.mass")
    _, found = listened(tracker, log, beside, lambda r: round(r.t, 6) in (6.5, 13.5))
    return np.array([[values[at] for values in of.of(r.belief)] for r in found])


BIAS = np.array([-75.0, 16.0, 3.0, 0.5, 0.2, 0.1])


def biased(_, sample):
    """Every third row is a burst of nothing, and for half a second somebody leans on the tool."""
    row = sample.beside["raw_wrench"] + np.r_[0.0, BIAS]
    row[0, 1] += 60.0 * (4.0 < sample.t < 4.5)
    row[0, 1:] += np.nan if round(sample.t * RATE) % 3 == 0 else 0.0
    return {"raw_wrench": row}


def test_a_sensor_at_the_flange_weighs_what_currents_weigh_too():
    fit, log, alone = weighed()
    stream = WrenchStream(fit.dynamics.arm, True)
    tracker = Tracker(fit, EKF(), 1.0 / RATE, streams=(stream,))
    felt = masses(tracker, log, biased)
    for mean, sd in (alone[1], felt[1]):
        assert abs(mean - 2.5) < 3.0 * sd
    assert felt[1, 1] < 0.6 * alone[1, 1]


def test_what_the_controller_compensates_for_is_unknown_but_for_a_change():
    """Its wrench says nothing of the payload at first, and how much was taken up afterwards."""
    fit, log, alone = weighed()
    stream = WrenchStream(fit.dynamics.arm, False)
    felt = masses(Tracker(fit, EKF(), 1.0 / RATE, streams=(stream,)), log)
    assert abs(felt[1, 0] - 2.5) < 3.0 * felt[1, 1]
    assert felt[0, 1] > 0.97 * alone[0, 1] and felt[1, 1] < 0.9 * alone[1, 1]


def test_a_compensated_wrench_is_turned_into_the_axes_of_the_flange(ur5e):
    """Nothing is compensated for, so that there it is what the sensor feels, pushes and all."""
    ways = [np.random.default_rng([0, 7, k]) for k in range(2)]
    asked, dynamics = fourier(ur5e, 4.0, SLOW, ways[0]), virtual_arm(ur5e, 1)
    befall = ("payload_change:mass=2.5,onset=0", "collision:link=5,force=90/40/60,onset=1")
    sensors = replace(typical_sensors(ur5e), wrench_noise=(0.0, 0.0), encoder_step=0.0)
    log = observe(dynamics, asked, sensors, ways[1], [parse_fault(one, 6) for one in befall])
    stream = WrenchStream(ur5e, False)
    told = zip(log.joint("actual_q"), log.joint("actual_TCP_force"), strict=True)
    there = [stream._into_flange(q, wrench) for q, wrench in told]
    np.testing.assert_allclose(there, log.joint("ft_raw_wrench"), atol=1e-9)


def test_errors_that_all_holds_have_in_common_count_once():
    """By currents, every load is weighed with the same friction; of that the sensor tells nothing.

    Nor is it told of each time that something else may be carried.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng([2, 77])
    work = pick_and_place(dynamics.arm, 24.0, SLOW, rng, Payload(2.5, np.array([0.0, 0.0, 0.08])))
    sensors = replace(typical_sensors(dynamics.arm), wrench_noise=(1.0, 0.02))
    [pieces] = work.handling
    log = observe(dynamics, work.trajectory, sensors, rng, work.handling)
    tracker = Tracker(fit, EKF(), 1.0 / SLOW, streams=(WrenchStream(fit.dynamics.arm, True),))
    ends = np.floor(SLOW * pieces.begin[1:]) / SLOW - 2.0 / SLOW
    _, told = listened(tracker, log, every=lambda r: np.abs(r.t - ends).min() < 0.25 / SLOW)
    first = tracker.currents.places["payload"].start
    mass, sd = np.array([(r.belief.mean[first], r.belief.sd[first]) for r in told]).T
    z = (mass - pieces.carried[: len(ends), 0]) / sd
    assert len(z) == len(ends) and (np.abs(z) < 3.0).all()


def felt_alone(stream, count, bias, payload, rng, arm):
    """Rows of a still arm in many poses, the payload being known to be `payload`."""
    felt, own = stream.init(), stream.own.prior
    known = Gaussian(np.r_[payload, own.mean], np.diag(np.r_[np.full(10, 1e-12), own.sd**2]))
    at, standing = np.arange(len(known.mean)), Standing(("payload",) * 10 + stream.own.names, known)
    for k in range(count):
        q, v, a = rng.uniform(-1.5, 1.5, (3, 6))
        now = Instant(float(k), q, v, a, *np.zeros((4, 6)))
        w = bias - arm.wrench_regressor(q, v, a) @ payload + rng.standard_normal(6) * NOISE
        felt, told = stream.take(felt, now, np.r_[now.t, w], known)
        if told is not None:
            seen = LinearMeasurement(at, told.H, told.R, told.jump)
            known, _ = EKF().step(standing, known, seen, told.y)
            felt = stream.settled(felt, known)
    return felt


NOISE = np.repeat([1.0, 0.02], 3)


def test_what_a_sensor_shows_of_nothing_is_found(ur5e):
    rng, stream = np.random.default_rng(1), WrenchStream(ur5e, True)
    body = np.array([2.0, 0.02, -0.04, 0.16, 0.03, 0.0, 0.03, 0.0, 0.0, 0.01])
    felt = felt_alone(stream, 900, BIAS, body, rng, ur5e)
    mean, sd = stream.estimates(felt)
    assert np.sum(((mean - BIAS) / sd) ** 2) < 22.5  # chi-square of six, once in a thousand
    # An average over 300 rows of three: a standard deviation is known to 3 %.
    np.testing.assert_allclose(felt.noise, NOISE[[0, 3]], rtol=0.12)


UP, ASIDE = np.array([0.0, 0.0, 40.0]), np.array([40.0, 0.0, 0.0])  # [N] in the base's axes


@pytest.mark.parametrize(
    ("push", "mass", "touching"),
    [(UP, 0.0, True), (ASIDE, 0.0, True), (-UP, 0.0, False), (0.0 * UP, 4.0, False)],
)
def test_a_wrench_that_no_payload_explains_is_contact_and_may_last(ur5e, push, mass, touching):
    """A force down is as a load's; a bias is not forgotten for 18 s of contact."""
    rng, stream, still = np.random.default_rng(2), WrenchStream(ur5e, True), np.zeros(6)
    felt = replace(stream.init(), noise=NOISE[[0, 3]])
    known = Gaussian(np.r_[np.zeros(10), BIAS], 0.01 * np.eye(16))
    for k in range(200):
        q, at_work = rng.uniform(-1.5, 1.5, 6), 20 <= k < 180
        now = Instant(0.1125 * k, q, still, still, *np.zeros((4, 6)))
        turn = ur5e.pose(q, ur5e.link_names[-1])[:3, :3]
        load = mass * ur5e.wrench_regressor(q, still, still)[:, 0]
        w = BIAS + at_work * (np.r_[turn.T @ push, np.zeros(3)] - load)
        w += rng.standard_normal(6) * NOISE
        felt, told = stream.take(felt, now, np.r_[now.t, w], known)
        assert stream.touching(felt, now.t) == (touching and at_work)
        assert not touching or (told is None) == at_work
    assert not stream.touching(replace(felt, touching=True), now.t + 1.1)  # silent since


def test_a_bias_that_jumps_is_learnt_anew_although_it_looks_like_contact(ur5e):
    """As it does in most poses, not in all: after a minute of surprise, whichever."""
    rng, stream, still = np.random.default_rng(4), WrenchStream(ur5e, True), np.zeros(6)
    felt = replace(stream.init(), noise=NOISE[[0, 3]])
    known = Gaussian(np.r_[np.zeros(10), BIAS], 0.01 * np.eye(16))
    touched = []
    for k in range(ANEW_TOUCHING + 1):
        now = Instant(0.1125 * k, rng.uniform(-1.5, 1.5, 6), still, still, *np.zeros((4, 6)))
        w = BIAS + np.r_[40.0, np.zeros(5)] + rng.standard_normal(6) * NOISE
        felt, told = stream.take(felt, now, np.r_[now.t, w], known)
        assert (told is None) == (k < ANEW_TOUCHING)
        touched.append(stream.touching(felt, now.t))
    assert 0.5 < np.mean(touched[:-1]) < 1.0 and not touched[-1]


def test_currents_of_an_arm_whose_sensor_feels_contact_do_not_matter():
    """From the first row that shows it on. Where contact is told, wrenches do not matter either."""
    fit, log, _ = weighed()
    tracker = Tracker(fit, EKF(), 1.0 / RATE, streams=(WrenchStream(fit.dynamics.arm, True),))
    log, start, later = log.slice(0, round(4.0 * RATE)), 3.0, 3.4

    def learnt(amperes, known=False):
        state = tracker.init()
        for sample in samples(log):
            push = np.r_[0.0, 0.0, 300.0 * (sample.t > start), np.zeros(4)]
            row = {"raw_wrench": sample.beside["raw_wrench"] + push}
            current = sample.current + amperes * (sample.t > later)
            told = replace(sample, beside=row, current=current)
            state, seen = tracker.step(state, replace(told, in_contact=known and sample.t > start))
            withheld = seen is not None and np.isnan(seen.current).all()
            # Diagnosis is to see a push, and to learn nothing from it.
            assert known or not withheld or np.isfinite(seen.instant.current).any()
            assert known or not withheld or not seen.travelled.any()
        return state

    free, pressed = learnt(0.0), learnt(1.0)
    np.testing.assert_array_equal(free.belief.mean, pressed.belief.mean)
    assert 0.8 * RATE < pressed.touched < 1.0 * RATE
    known = learnt(0.0, known=True)
    assert known.touched == 0 and known.heard[0].state.t < start + 0.1


@pytest.mark.parametrize("shows", [0.0, 3.0])
def test_a_sensor_at_the_flange_that_is_stuck_tells_nothing(shows):
    """That nothing changes while a load is taken up would be news of the drives."""
    fit, log, alone = weighed()
    stream = WrenchStream(fit.dynamics.arm, True)
    tracker = Tracker(fit, EKF(), 1.0 / RATE, streams=(stream,))

    def stuck(_, sample):
        return {"raw_wrench": np.r_[sample.t, np.full(6, shows)][None]}

    felt = masses(tracker, log, stuck)
    assert np.allclose(felt, alone, rtol=0.02, atol=0.01)


def test_velocities_that_are_missing_skip_themselves_alone():
    """The motion is told by the angles then, and currents by the motion."""
    fit, _, log, _ = life()
    asked = log.slice(0, 500)
    silent = replace(asked, channels={**asked.channels, "actual_qd": np.full((500, 6), np.nan)})
    found = []
    for told in (asked, silent):
        tracker = Tracker(fit, EKF(), 1.0 / RATE)
        state, _ = listened(tracker, told)
        found.append(tracker.filter.belief(state.belief))
    at = tracker.currents.places["f"]
    assert np.abs((found[0].mean - found[1].mean)[at] / found[0].sd[at]).max() < 1.0
    assert (found[1].sd[at] < 0.95 * tracker.model.prior.sd[at]).any()
