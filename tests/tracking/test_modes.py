"""Quicker modes: what they assume, and what that costs."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.dbn import Joined, RandomWalk
from urdyn.dbn.measurement import LinearMeasurement
from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import MODES, QUICKER, Tracker, losses, side_by_side
from urdyn.tracking.belief.blocks import WAIT, Blocks, places
from urdyn.tracking.belief.model import ANYTHING, LIGHT, PAYLOAD_SD


@pytest.fixture(scope="module")
def modes(workshop):
    return side_by_side(workshop.fit, EKF(), list(samples(workshop.log.slice(0, 500))))


def test_every_state_is_shared_or_a_drives(workshop):
    model = Tracker(workshop.fit, EKF(), 0.01).model
    shared, drives = places(model.names)
    both = np.concatenate([shared, drives.ravel()])
    assert sorted(both.tolist()) == list(range(len(model.names)))
    of = {model.names[k].removesuffix(".rate").rpartition("_")[2] for k in drives[3]}
    assert of == {"3"}


def test_a_quicker_mode_begins_where_full_does(workshop):
    model = Tracker(workshop.fit, EKF(), 0.01).model
    prior = Blocks().belief(Blocks().init(model))
    np.testing.assert_array_equal(prior.mean, model.prior.mean)
    np.testing.assert_allclose(prior.sd, model.prior.sd)


def test_currents_alone_leave_drives_independent_given_what_they_share(workshop):
    """Until something strays the belief keeps its form, so that nothing is lost: full says it."""
    tracker, filter_ = Tracker(workshop.fit, EKF(), 0.01), Blocks()
    names, prior = tracker.model.names, tracker.model.prior
    model = Joined(RandomWalk(names, prior, np.zeros(len(names))), tracker.currents)
    state, quick = tracker.init(), filter_.init(model)
    full = filter_.belief(quick)
    for k, sample in enumerate(samples(workshop.log.slice(0, 400))):
        state, reading = tracker.step(state, sample)
        if reading is None or k % 4:
            continue
        u, y = reading.learnt
        y = np.where(np.arange(6) == k % 7, np.nan, y)
        full, _ = EKF().step(model, full, u, y)
        quick, _ = filter_.step(model, quick, u, y)
    after = filter_.belief(quick)
    assert (full.sd < 0.5 * prior.sd).sum() > 8
    known = full.sd > 0.0
    sd = np.where(known, full.sd, 1.0)
    np.testing.assert_allclose((after.mean - full.mean) / sd, 0.0, atol=1e-5)
    np.testing.assert_allclose((after.cov - full.cov) / np.outer(sd, sd), 0.0, atol=1e-5)


@pytest.mark.parametrize("jump", [0.0, 0.02])
def test_what_others_tell_of_zeros_moves_drives_as_far_as_they_follow_them(workshop, jump):
    """Kalman's correction of all states says it; zeros that may have jumped took no drive along."""
    tracker, rng = Tracker(workshop.fit, Blocks(), 0.01), np.random.default_rng(3)
    state = tracker.init()
    for sample in samples(workshop.log.slice(0, 300)):
        state, _ = tracker.step(state, sample)
    filter_, at = tracker.filter, np.r_[tracker.currents.places["k"]]
    before, H = filter_.belief(state.belief), rng.normal(size=(3, 6))
    y = H @ (before.mean[at] + 0.01 * rng.normal(size=6))
    u = LinearMeasurement(at, H, 1e-8 * np.eye(3), np.full(6, jump))
    after = filter_.belief(filter_.step(tracker.model, state.belief, u, y)[0])
    P, whole = before.cov.copy(), np.zeros((3, len(before.mean)))
    P[at, at] += jump**2
    whole[:, at] = H
    K = P @ whole.T @ np.linalg.inv(whole @ P @ whole.T + u.R)
    sd = np.sqrt(np.diag(P - K @ whole @ P))
    np.testing.assert_allclose(after.sd, sd, rtol=1e-6)
    mean = before.mean + K @ (y - whole @ before.mean)
    np.testing.assert_allclose((after.mean - mean) / sd, 0.0, atol=1e-6)


def test_all_modes_find_the_same_arm(workshop, modes):
    joints = workshop.fit.dynamics.arm.joint_names
    names = [f"{joint}.{what}" for joint in joints for what in ("coulomb", "viscous")]
    lost = losses(modes, names, {})
    assert set(lost) == set(MODES)
    assert lost["full"].apart == 0.0 and lost["full"].faster == 1.0
    for name in QUICKER:
        print(name, lost[name])
        assert lost[name].apart < 1.0
        assert np.isnan(lost[name].rmse) and np.isnan(lost[name].coverage)


def test_a_quicker_mode_is_as_sure_as_full(workshop, modes):
    """Coverage counts on it: what strays costs some per cent, and what waits some more.

    A zero that no current shows strays for 1.2 s of these five before it is told to have.
    """
    for name in QUICKER:
        for quantity, sd in modes["full"].sd.items():
            ratio = modes[name].sd[quantity] / sd if sd else 1.0
            assert 0.85 < ratio < 1.3, (name, quantity, ratio)


def test_losses_are_errors_over_fulls(workshop, modes):
    name = f"{workshop.fit.dynamics.arm.joint_names[0]}.coulomb"
    truth = {name: modes["full"].mean[name] - modes["full"].sd[name]}
    lost = losses(modes, [name], truth)
    assert lost["full"].rmse == 1.0 and lost["full"].coverage == 1.0
    of_few = losses(modes, [*modes["full"].mean], truth)  # what is not known counts for nothing
    for mode in modes:
        told = (of_few[mode].rmse, of_few[mode].coverage)
        assert told == (lost[mode].rmse, lost[mode].coverage)


def test_a_joint_whose_current_hardly_tells_anything_waits(workshop):
    tracker = Tracker(workshop.fit, QUICKER["realtime"], 0.01)
    state = tracker.init()
    for sample in samples(workshop.log.slice(0, 1000)):
        state, _ = tracker.step(state, sample)
    assert (state.belief.wait.interval > 1).any()
    assert np.linalg.eigvalsh(tracker.filter.belief(state.belief).cov)[0] > 0.0


def test_no_joint_waits_for_long_where_samples_are_few(workshop):
    tracker = Tracker(workshop.fit, QUICKER["realtime"], 0.05)
    state, longest = tracker.init(), 0
    for sample in list(samples(workshop.log))[::5]:
        state, _ = tracker.step(state, sample)
        longest = max(longest, state.belief.wait.interval.max())
    assert 1 < longest <= WAIT / 0.05


@pytest.mark.parametrize("mode", QUICKER)
def test_what_a_joint_waits_for_is_its_current_and_another_load_hurries_it(workshop, mode):
    """While it stands it is doubted as it was; as it sets off it may carry anything."""
    tracker = Tracker(workshop.fit, QUICKER[mode], 0.01)
    state, stands = tracker.init(), np.full(6, np.nan)
    for sample in samples(workshop.log.slice(0, 1000)):
        state, reading = tracker.step(state, sample)
    filter_, belief = tracker.filter, state.belief
    for _ in range(40):
        waits = belief.wait.count > 0
        after, _ = filter_.step(tracker.model, belief, reading.inputs, stands)
        np.testing.assert_array_equal(after.wait.interval[~waits], belief.wait.interval[~waits])
        np.testing.assert_array_equal(after.variance_ratio[~waits], belief.variance_ratio[~waits])
        belief = after
    assert (belief.variance_ratio > 0.0).all() and not belief.wait.count.any()
    taken = replace(reading.inputs, taken=LIGHT)
    assert (filter_.step(tracker.model, belief, taken, stands)[0].wait.interval == 1).all()


def test_what_waits_is_not_taken_for_the_next_payload(workshop):
    """A payload that nothing was seen of yet is as unknown as the first."""
    tracker = Tracker(workshop.fit, Blocks(16), 0.01)
    state = tracker.init()
    for sample in samples(workshop.log.slice(0, 1500)):
        state, reading = tracker.step(state, sample)
        if state.belief.wait.count.max() > 4 and state.belief.wait.R.all():
            break
    else:
        pytest.fail("no joint waited")
    at, nothing = tracker.currents.places["payload"], np.full(6, np.nan)
    u = replace(reading.inputs, widen=True)
    belief = tracker.filter.belief(tracker.filter.step(tracker.model, state.belief, u, nothing)[0])
    np.testing.assert_array_equal(belief.mean[at], 0.0)
    np.testing.assert_allclose(belief.sd[at], ANYTHING * PAYLOAD_SD, rtol=1e-12)
