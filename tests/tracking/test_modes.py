"""Quicker modes: what they assume, and what that costs."""

from dataclasses import replace

import numpy as np
import pytest

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import MODES, QUICKER, Tracker, losses, side_by_side
from urdyn.tracking.blocks import Blocks, places
from urdyn.tracking.model import ANYTHING, PAYLOAD_SD


@pytest.fixture(scope="module")
def modes(workshop):
    return side_by_side(workshop.fit, EKF(), list(samples(workshop.log.slice(0, 500))))


def test_every_state_is_in_one_block(workshop):
    model = Tracker(workshop.fit, EKF(), 0.01).model
    bodies, drives = places(model.names)
    both = np.concatenate([bodies, drives.ravel()])
    assert sorted(both.tolist()) == list(range(len(model.names)))
    of = {model.names[k].removesuffix(".rate").rpartition("_")[2] for k in drives[3]}
    assert of == {"3"}


def test_a_quicker_mode_begins_where_full_does(workshop):
    model = Tracker(workshop.fit, EKF(), 0.01).model
    prior = Blocks().belief(Blocks().init(model))
    np.testing.assert_array_equal(prior.mean, model.prior.mean)
    np.testing.assert_allclose(prior.sd, model.prior.sd)


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


def test_a_quicker_mode_is_never_sure_without_reason(workshop, modes):
    """Coverage counts on it: a block that knows nothing of others cannot know much more.

    Nor much less: gains are known to 5 %, and full knows what they leave in common.
    """
    joints = workshop.fit.dynamics.arm.joint_names
    for name in QUICKER:
        for joint in joints:
            ratio = modes[name].sd[f"{joint}.coulomb"] / modes["full"].sd[f"{joint}.coulomb"]
            assert 0.6 < ratio < 1.8, (name, joint)


def test_losses_are_errors_over_fulls(workshop, modes):
    name = f"{workshop.fit.dynamics.arm.joint_names[0]}.coulomb"
    truth = {name: modes["full"].mean[name] - modes["full"].sd[name]}
    lost = losses(modes, [name], truth)
    assert lost["full"].rmse == 1.0 and lost["full"].coverage == 1.0


def test_a_block_that_hardly_changes_waits(workshop):
    tracker = Tracker(workshop.fit, QUICKER["realtime"], 0.01)
    state = tracker.init()
    for sample in samples(workshop.log.slice(0, 1000)):
        state, _ = tracker.step(state, sample)
    assert state.belief.for_bodies.interval > 1
    assert np.linalg.eigvalsh(tracker.filter.belief(state.belief).cov)[0] > 0.0


def test_what_waits_is_not_taken_for_the_next_payload(workshop):
    """A payload that nothing was seen of yet is as unknown as the first."""
    tracker = Tracker(workshop.fit, Blocks(16), 0.01)
    state = tracker.init()
    for sample in samples(workshop.log.slice(0, 1500)):
        state, reading = tracker.step(state, sample)
        if state.belief.for_bodies.count > 4 and state.belief.for_bodies.R.all():
            break
    else:
        pytest.fail("no block waited")
    at, nothing = tracker.currents.places["payload"], np.full(6, np.nan)
    u = replace(reading.inputs, widen=True)
    belief = tracker.filter.belief(tracker.filter.step(tracker.model, state.belief, u, nothing)[0])
    np.testing.assert_array_equal(belief.mean[at], 0.0)
    np.testing.assert_allclose(belief.sd[at], ANYTHING * PAYLOAD_SD, rtol=1e-12)
