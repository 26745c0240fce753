"""What is carried, as it is told while a filter learns it anew."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from workshop import commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.simulate import observe, plan, typical_sensors
from urdyn.simulate.schedule import Handling
from urdyn.tracking import Tracker
from urdyn.tracking.belief.physical import KNOWN
from urdyn.tracking.step.abrupt_changes import LASTS
from urdyn.tracking.step.change_detection import ChangeDetector, Detection, Hypothesis
from urdyn.tracking.step.payload_belief import with_load
from urdyn.tracking.step.payload_handling import HandlingPhase, ImplausibleLoads, Rest
from urdyn.tracking.step.payload_hypotheses import (
    CHANGE,
    LOAD,
    OTHERS,
    SURE,
    WIDE,
    PayloadHypotheses,
    no_hypotheses,
)
from urdyn.tracking.step.wear_test import WearTest
from urdyn.types import Gaussian


def drawn(rng: np.random.Generator, scale: float = 0.1) -> Gaussian:
    """A load that was weighed."""
    root = scale * rng.normal(size=(LOAD, LOAD)) * OTHERS[-1]
    return Gaussian(rng.normal(size=LOAD) * OTHERS[-1], root @ root.T + np.diag(1e-4 * OTHERS[0]))


def learnt(first: np.ndarray, H: np.ndarray, y: np.ndarray) -> Gaussian:
    """What a filter that began anew believes, by y = H p and noise of variance 1."""
    cov = np.linalg.inv(np.diag(WIDE**-2) + H.T @ H)
    return Gaussian(first + cov @ H.T @ (y - H @ first), cov)


def log_likelihood(prior: Gaussian, H: np.ndarray, y: np.ndarray) -> float:
    """Of the measurements, by who believed that."""
    spread = H @ prior.cov @ H.T + np.eye(len(y))
    return float(multivariate_normal(H @ prior.mean, spread).logpdf(y))


def conditioned(prior: Gaussian, H: np.ndarray, y: np.ndarray) -> Gaussian:
    """What who believed that believes by the measurements."""
    K = prior.cov @ H.T @ np.linalg.inv(H @ prior.cov @ H.T + np.eye(len(y)))
    return Gaussian(prior.mean + K @ (y - H @ prior.mean), prior.cov - K @ H @ prior.cov)


@pytest.mark.parametrize("rows", [1, 3, 12])
def test_the_wide_filter_s_belief_tells_what_any_prior_makes_of_the_measurements(rows):
    """An oracle: of a load that surely is another, mean and covariance of the mixture."""
    rng = np.random.default_rng(rows)
    H = rng.normal(size=(rows, LOAD)) / OTHERS[0]
    first, y = rng.normal(size=LOAD), 2.0 * rng.normal(size=rows)
    was, now = drawn(rng), learnt(first, H, y)
    others = [Gaussian(np.zeros(LOAD), np.diag(sd**2)) for sd in OTHERS]
    odds = np.array([log_likelihood(of, H, y) for of in others])
    share = np.exp(odds - np.logaddexp.reduce(odds))
    each = [conditioned(of, H, y) for of in others]
    mean = each[share.argmax()].mean
    cov = sum(
        w * (of.cov + np.outer(of.mean - mean, of.mean - mean))
        for w, of in zip(share, each, strict=True)
    )
    told = PayloadHypotheses(was.mean, was.cov, first, 1.0, told=False).believed(now)
    np.testing.assert_allclose(told.mean, mean, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(told.cov, cov, rtol=1e-6, atol=1e-8)


def test_another_is_told_by_the_odds_of_what_was_measured():
    rng, told = np.random.default_rng(0), 0
    for _ in range(200):
        H, was = rng.normal(size=(2, LOAD)), drawn(rng)
        y = H @ (was.mean + rng.normal(size=LOAD) * OTHERS[-1]) + rng.normal(size=2)
        held = PayloadHypotheses(was.mean, was.cov, np.zeros(LOAD), CHANGE, told=False)
        others = [Gaussian(np.zeros(LOAD), np.diag(sd**2)) for sd in OTHERS]
        another = np.logaddexp.reduce([log_likelihood(of, H, y) for of in others])
        odds = another + np.log(CHANGE / 2) - log_likelihood(was, H, y) - np.log(1.0 - CHANGE)
        assert held.exchanged(learnt(np.zeros(LOAD), H, y)) == (odds > SURE)
        told += odds > SURE
    assert 20 < told < 180


def test_before_anything_is_measured_the_number_stays_and_its_sd_says_how_rests_end():
    was = Gaussian(np.array([2.5, 0.0, 0.0, 0.2]), np.diag([0.07, 0.01, 0.01, 0.01]) ** 2)
    told = PayloadHypotheses(was.mean, was.cov, np.zeros(LOAD), CHANGE, told=False).believed(
        Gaussian(np.zeros(LOAD), np.diag(WIDE**2))
    )
    others = (OTHERS**2).mean(axis=0) + was.mean**2
    np.testing.assert_allclose(told.mean, was.mean)
    np.testing.assert_allclose(told.sd**2, (1.0 - CHANGE) * was.sd**2 + CHANGE * others)


def test_a_piece_put_down_is_told_once_however_often_the_arm_sets_off_before_that_is_known():
    """An arm that stands jerks as it loses a piece, and sets off half a second later."""
    was = Gaussian(np.array([2.0, 0.0, 0.0, 0.16]), np.diag([0.04, 0.01, 0.01, 0.01]) ** 2)
    unknown = Gaussian(was.mean, np.diag(WIDE**2))
    rather, surely = (Gaussian(np.zeros(LOAD), was.cov * k**2) for k in (10.0, 1.0))
    held = no_hypotheses().anew(was, was.mean, CHANGE, told=False)
    for _ in range(5):
        assert not held.exchanged(unknown) and held.exchanged(surely)
        np.testing.assert_allclose(held.believed(unknown).mean, was.mean)
        held = held.anew(unknown, was.mean, CHANGE, told=False)
    assert rather.sd[0] > KNOWN
    told = replace(held, told=True).anew(rather, was.mean, CHANGE, told=False)
    assert not told.exchanged(surely)


@pytest.mark.parametrize(("since", "told"), [(0.9 * LASTS, False), (1.1 * LASTS, True)])
def test_how_joints_break_loose_tells_no_load(since, told):
    """For some samples that may be any load's: nothing carried was told to be another load."""
    _, fit = commissioned(0)
    tracker = Tracker(fit, EKF(), 1.0 / 50.0)
    state, places = tracker.init(), tracker.currents.places
    process, first = tracker.model.process.process, places["payload"].start
    detector = ChangeDetector(
        EKF(), WearTest(process), places, fit.dynamics.drive, tool=0.0, period=0.02, poses=False
    )
    was = Gaussian(np.array([2.0, 0.0, 0.0, 0.16]), np.diag([0.04, 0.01, 0.01, 0.01]) ** 2)
    held = PayloadHypotheses(was.mean, was.cov, was.mean, CHANGE, told=False)
    nothing = with_load(state.belief, Gaussian(np.zeros(LOAD), was.cov), first)
    start = replace(state, t=10.0 + since, rest=Rest(over=10.0), load=held)
    hypothesis = Hypothesis(
        Detection(None, reported=False, looked=True, evidence=state.evidence),
        HandlingPhase(False, True, False, ImplausibleLoads(), False),
        start, state.belief, state.belief.mean, state.payload, held,
    )  # fmt: skip
    assert held.exchanged(Gaussian(np.zeros(LOAD), was.cov))
    assert detector.updated_load(hypothesis, nothing, moving=True).told is told


def test_to_be_weighed_alike_again_makes_nothing_surer():
    was = drawn(np.random.default_rng(1), scale=0.01)
    held = PayloadHypotheses(was.mean, was.cov, np.zeros(LOAD), 0.0, told=True)
    told = held.believed(was)
    np.testing.assert_allclose(told.mean, was.mean, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(told.cov, was.cov, rtol=1e-2, atol=1e-6)


def test_the_better_known_of_both_counts_for_more():
    was = Gaussian(np.array([1.0, 0.0, 0.0, 0.0]), np.diag([0.05, 0.01, 0.01, 0.01]) ** 2)
    held = PayloadHypotheses(was.mean, was.cov, np.zeros(LOAD), 0.0, told=True)
    told = [
        held.believed(Gaussian(np.array([1.1, 0, 0, 0]), np.diag([sd, 0.01, 0.01, 0.01]) ** 2))
        for sd in (0.5, 0.05, 0.005)
    ]
    rather, both, now = (of.mean[0] for of in told)
    assert rather < 1.001 < 1.04 < both < 1.06 < 1.099 < now


def test_what_is_not_learnt_anew_is_what_the_filter_believes():
    now = drawn(np.random.default_rng(2))
    assert no_hypotheses().believed(now) is now
    held = PayloadHypotheses(now.mean, now.cov, now.mean, CHANGE, told=False)
    assert held.doubted and not held.given_up().doubted
    assert held.given_up().believed(now) is now


def test_another_load_in_a_belief_changes_nothing_else():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(9, 9))
    belief, load = Gaussian(rng.normal(size=9), root @ root.T), drawn(rng)
    told, at, rest = with_load(belief, load, 3), slice(3, 3 + LOAD), [0, 1, 2, 7, 8]
    np.testing.assert_allclose(told.mean[at], load.mean)
    np.testing.assert_allclose(told.cov[at, at], load.cov, atol=1e-12)
    np.testing.assert_array_equal(told.mean[rest], belief.mean[rest])
    np.testing.assert_allclose(told.cov[np.ix_(rest, rest)], belief.cov[np.ix_(rest, rest)])
    assert (np.linalg.eigvalsh(told.cov) > 0.0).all()
    own = Gaussian(belief.mean[at], belief.cov[at, at])
    np.testing.assert_allclose(with_load(belief, own, 3).cov, belief.cov, atol=1e-9)


def test_a_piece_that_stays_through_many_rests_stays_as_known_and_is_told_once():
    """A story: from point to point with a piece of 2 kg that is there from the tenth second on.

    To the filter it is anything anew at each set-off, for tenths of a second or more, and this had
    been told.
    """
    dynamics, fit = commissioned(0)
    rng, piece = np.random.default_rng(2), np.array([2.0, 0, 0, 0.16, 0.02, 0, 0.02, 0, 0, 2e-3])
    work = plan("point_to_point", dynamics.arm, 60.0, 50.0, rng)
    handling = Handling(np.array([10.0]), np.array([piece]))
    log = observe(
        dynamics, work.trajectory, typical_sensors(dynamics.arm), rng, (*work.handling, handling)
    )
    tracker = Tracker(fit, EKF(), 1.0 / 50.0)
    state, at, told, own, changes = tracker.init(), tracker.currents.places["payload"], [], [], 0
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is None:
            continue
        changes += reading.widened
        if reading.t > 16.0:
            of = reading.belief
            told.append((of.mean[at][0] - piece[0], of.sd[at][0]))
            own.append((state.belief.mean[at][0] - piece[0], state.belief.sd[at][0]))
    (off, sd), (alone, _) = np.array(told).T, np.array(own).T
    assert changes == 1
    assert (np.abs(alone) > 0.3).any()
    assert np.abs(off).max() < 0.3
    assert (np.abs(off) < 4.0 * sd).all()
