"""What befalls an arm at once is told to every filter, in whatever form it keeps its belief."""

import numpy as np
import pytest
from workshop import at_work, commissioned

from urdyn.estimate import EKF, UKF, InformationFilter, ParticleFilter, Variational
from urdyn.signal import samples
from urdyn.tracking import QUICKER, Tracker, open_source
from urdyn.tracking.belief import beliefs
from urdyn.tracking.step.state import with_encoder_jump
from urdyn.types import Gaussian

GAUSSIAN = [EKF(), UKF(), InformationFilter(), Variational(), *QUICKER.values()]
EVERY = [*GAUSSIAN, ParticleFilter(64)]


@pytest.mark.parametrize("filter_", EVERY, ids=repr)
def test_an_encoder_that_jumps_moves_its_zero_in_every_belief(filter_):
    tracker = Tracker(commissioned(0)[1], filter_, 0.01)
    before, zeros = tracker.init(), tracker.currents.places["k"]
    jump = np.array([0.0, 0.02, 0.0, 0.0, -0.01, 0.0])
    after = with_encoder_jump(before, filter_, zeros, jump)
    own = filter_.belief(before.belief)
    past = after.past
    for state in (after, past.next_rollback, past.rollback, past.reference, past.recent):
        known = filter_.belief(state.belief)
        moved = (known.mean - own.mean) / own.sd
        moved[zeros] += jump / own.sd[zeros]
        # Information is inverted: of a hundred states, whose precisions differ by 1e12 and more.
        np.testing.assert_allclose(moved, 0.0, atol=1e-6)
        np.testing.assert_allclose(known.sd, own.sd, rtol=1e-6)


@pytest.mark.parametrize("filter_", GAUSSIAN, ids=repr)
def test_a_gaussian_filter_believes_what_it_is_given(filter_):
    tracker = Tracker(commissioned(0)[1], filter_, 0.01)
    state = tracker.init().belief
    own = filter_.belief(state)
    told = Gaussian(own.mean + 0.5 * own.sd, 4.0 * own.cov)
    known = filter_.belief(beliefs.replaced(filter_, state, told))
    np.testing.assert_allclose((known.mean - told.mean) / own.sd, 0.0, atol=1e-6)
    np.testing.assert_allclose(known.sd, 2.0 * own.sd, rtol=1e-6)
    assert not beliefs.lacking(filter_)


def test_a_filter_that_cannot_be_given_a_belief_says_so():
    cloud = ParticleFilter(64)
    assert "ParticleFilter keeps no Gaussian" in beliefs.lacking(cloud)
    assert "intervals are too narrow" in beliefs.lacking(cloud)
    assert "encoder" not in beliefs.lacking(cloud)


def test_particles_that_are_copies_of_one_tell_no_wear():
    """They have no errors by which to weigh what they believed before."""
    dynamics, fit = commissioned(0)
    tracker = Tracker(fit, ParticleFilter(1), 0.02)
    state = tracker.init()
    for sample in samples(at_work(dynamics, 0, 5, 3.0, rate=50.0)):
        state, _ = tracker.step(state, sample)
    assert state.moved > 1.0 and not state.changed_drives.any()


def test_a_run_says_what_its_filter_lacks(workshop, tmp_path):
    said = []
    source = open_source(str(workshop.recording), rows=(0, 60), tell=said.append)
    workshop.track(tmp_path / "a", source)
    assert not said
    workshop.track(tmp_path / "b", source, filter=ParticleFilter(20))
    (told,) = said
    assert "ParticleFilter keeps no Gaussian" in told


def test_information_goes_through_jumps_as_covariance_does():
    """Both filters are one, in dual coordinates: what befalls the arm must not tell them apart."""
    dynamics, fit = commissioned(0)
    faults = (
        "encoder_offset:joint=2,offset=0.02,onset=4",
        "friction_increase:joint=1,onset=6,rate=1,shape=step",
    )
    log = at_work(dynamics, 0, 5, 9.0, *faults, rate=50.0)
    ends = []
    for filter_ in (EKF(), InformationFilter()):
        tracker = Tracker(fit, filter_, 0.02)
        state = tracker.init()
        for sample in samples(log):
            state, reading = tracker.step(state, sample)
        ends.append((state, reading.belief))
    (state, belief), (dual, other) = ends
    assert state.changed_drives.any()
    np.testing.assert_array_equal(dual.changed_drives, state.changed_drives)
    assert (dual.changed_at, dual.widened) == (state.changed_at, state.widened)
    apart = np.abs(other.mean - belief.mean) / belief.sd
    # Inverted as above.
    assert apart.max() < 1e-6
    np.testing.assert_allclose(other.sd, belief.sd, rtol=1e-6)
