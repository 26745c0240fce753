"""What is carried, as it is told where drives most likely give what they gave at commissioning."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm
from workshop import commissioned

from urdyn.estimate import EKF, ParticleFilter
from urdyn.signal import samples
from urdyn.simulate import fourier, observe, typical_sensors
from urdyn.simulate.schedule import Handling
from urdyn.tracking import QUICKER, Tracker
from urdyn.tracking.belief.model import HEALTH_SD
from urdyn.tracking.step.health_prior import ALIKE, ALIKE_SD, HealthPrior
from urdyn.tracking.step.payload_hypotheses import LOAD
from urdyn.types import Gaussian

J = 6
NOTHING_FELL = np.zeros(J, dtype=bool)


@pytest.fixture(scope="module")
def health_prior() -> HealthPrior:
    """Of a commissioned arm."""
    tracker = Tracker(commissioned(0)[1], EKF(), 0.01)
    process = tracker.model.process.process
    return HealthPrior(process, tracker.currents.places["z"])


def learnt(health_sd: np.ndarray, H: np.ndarray, y: np.ndarray) -> Gaussian:
    """Load and health, by y = H x and noise of variance 1, and priors of 1 and of these sd."""
    prior = np.diag(np.r_[np.ones(LOAD), health_sd**2])
    K = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + np.eye(len(y)))
    return Gaussian(K @ y, prior - K @ H @ prior)


@pytest.mark.parametrize("fallen", [[], [2], [0, 4]])
def test_the_filter_s_belief_tells_what_any_prior_of_health_makes_of_the_measurements(
    health_prior, fallen
):
    """An oracle: mean and covariance of the mixture, each supposition learnt from anew.

    Of a drive that is not supposed to be alike, half of what its prior holds possible is not.
    """
    rng = np.random.default_rng(len(fallen))
    fell = np.isin(np.arange(J), fallen)
    v = np.where(fell, 0.1, HEALTH_SD)  # what befell a drive is in the filter's belief
    H = rng.normal(size=(12, LOAD + J)) * np.r_[np.full(LOAD, 3.0), np.full(J, 100.0)]
    y = H @ np.r_[rng.normal(size=LOAD), 0.6 * v * rng.normal(size=J)] + rng.normal(size=12)
    alike = [~fell, *(~fell & (np.arange(J) != j) for j in range(J)), fell & ~fell]
    prior = np.r_[ALIKE**J, np.full(J, ALIKE ** (J - 1) * (1.0 - ALIKE))]
    prior = np.r_[prior, 1.0 - prior.sum()]
    each = [np.where(of, ALIKE_SD, v) for of in alike]
    spread = [H @ np.diag(np.r_[np.ones(LOAD), sd**2]) @ H.T + np.eye(12) for sd in each]
    share = prior * [multivariate_normal(np.zeros(12), of).pdf(y) for of in spread]
    beliefs = [learnt(sd, H, y) for sd in each]
    less = [2.0 * norm.cdf(0.0, of.mean[LOAD:], of.sd[LOAD:]) for of in beliefs]
    share *= np.where(np.array(alike) | fell, 1.0, less).prod(axis=1)
    share /= share.sum()
    mean = sum(w * of.mean[:LOAD] for w, of in zip(share, beliefs, strict=True))
    apart = [of.mean[:LOAD] - mean for of in beliefs]
    cov = sum(
        w * (of.cov[:LOAD, :LOAD] + np.outer(a, a))
        for w, of, a in zip(share, beliefs, apart, strict=True)
    )
    told = health_prior.load(learnt(v, H, y), 0.0, fell)
    np.testing.assert_allclose(told.mean, mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(told.cov, cov, rtol=1e-6, atol=1e-9)


def beside(load_sd: float, health: float, health_sd: float) -> Gaussian:
    """A load and the shoulder's health that are hard to tell apart: a kilogram for a tenth."""
    mean, cov = np.zeros(LOAD + J), np.diag(np.r_[np.ones(LOAD), np.full(J, HEALTH_SD)] ** 2)
    mean[LOAD + 1] = health
    cov[0, 0], cov[LOAD + 1, LOAD + 1] = load_sd**2, health_sd**2
    cov[0, LOAD + 1] = cov[LOAD + 1, 0] = 0.95 * load_sd * health_sd
    return Gaussian(mean, cov)


def test_a_load_is_told_as_if_drives_were_alike_until_one_surely_changed(health_prior):
    """By how far health lies off: what hardly does is not health, and what surely does is."""
    moved = [
        health_prior.load(beside(0.1, health, 0.005), 0.0, NOTHING_FELL).mean[0]
        for health in (-0.002, -0.01, -0.04)
    ]
    assert moved[0] == pytest.approx(0.95 * 0.1 * 0.4 * 0.77, rel=0.1)
    assert abs(moved[2]) < 1e-4 < abs(moved[1])


def test_drives_that_seem_to_give_more_leave_a_load_as_if_they_were_alike(health_prior):
    """For none does: what makes them seem so is no health, however sure the filter is of it."""
    for sd in (0.005, 0.001):
        less, more = (
            health_prior.load(beside(0.1, health, sd), 0.0, NOTHING_FELL).mean[0]
            for health in (-0.06, 0.06)
        )
        of_prior = 1.0 / (1.0 / ALIKE_SD**2 - 1.0 / HEALTH_SD**2)  # variance of a 0 that is read
        assert abs(less) < 1e-4
        assert more == pytest.approx(-0.95 * 0.1 * sd * 0.06 / (sd**2 + of_prior), rel=1e-3)


def test_what_something_befell_is_as_the_filter_believes(health_prior):
    belief = beside(0.1, -0.005, 0.005)
    told = health_prior.load(belief, 0.0, np.ones(J, dtype=bool))
    np.testing.assert_allclose(told.mean, belief.mean[:LOAD])
    np.testing.assert_allclose(told.cov, belief.cov[:LOAD, :LOAD])
    shoulder = np.arange(J) == 1
    assert health_prior.load(belief, 0.0, shoulder).mean[0] == pytest.approx(0.0, abs=1e-12)


def test_as_health_strays_the_first_day_says_less_and_less(health_prior):
    belief = beside(0.1, -0.005, 0.005)
    told = [health_prior.load(belief, t, NOTHING_FELL) for t in (0.0, 300.0, 1800.0, 4 * 3600.0)]
    moved = np.array([of.mean[0] for of in told])
    sd = np.array([of.sd[0] for of in told])
    assert (np.diff(moved) < 0.0).all() and (np.diff(sd) > 0.0).all()
    assert moved[-1] < 0.01 * moved[0] and sd[-1] == pytest.approx(0.1, rel=1e-2)


@pytest.mark.parametrize("passed", [0.0, 300.0, 3600.0])
def test_health_strays_in_a_load_s_prior_as_it_does_in_the_filter(health_prior, passed):
    """An oracle: what the process itself makes of the first day after so long."""
    wear, at = health_prior.wear, health_prior.at
    variance = wear.later(wear.prior, passed, False).cov.diagonal()[at]
    strayed = variance - wear.prior.cov.diagonal()[at]
    narrow = ALIKE_SD**2 + strayed
    d, likelier = health_prior._known(passed)
    np.testing.assert_allclose(d**2, 1.0 / narrow - 1.0 / variance, rtol=1e-6)
    np.testing.assert_allclose(likelier, 0.5 * np.log(variance / narrow), rtol=1e-6)


PIECE = np.array([2.5, 0.0, 0.0, 0.2, 0.03, 0.0, 0.03, 0.0, 0.0, 3e-3])


def carrying(elbow: float, seconds: float):
    """A twin, and samples of its arm that carries a piece, and whose elbow gives so much [-]."""
    dynamics, fit = commissioned(0)
    gain = dynamics.drive.gain * np.array([1.0, 1.0, elbow, 1.0, 1.0, 1.0])
    arm = replace(dynamics, drive=replace(dynamics.drive, gain=gain))
    asked = fourier(arm.arm, seconds, 50.0, np.random.default_rng(1))
    piece = [Handling(np.array([0.0]), PIECE[None])]
    log = observe(arm, asked, typical_sensors(arm.arm), np.random.default_rng(11), piece)
    return fit, samples(log)


@pytest.mark.parametrize("elbow", [1.0, 0.96])
def test_a_run_that_begins_with_a_piece_weighs_it_better_and_follows_health_as_before(elbow):
    """A story: whether an elbow is as it was, or gives 4 % less, which is not put on the piece."""
    fit, log = carrying(elbow, 25.0)
    tracker = Tracker(fit, EKF(), 0.02)
    state, at, errors = tracker.init(), tracker.currents.places, []
    for sample in log:
        state, reading = tracker.step(state, sample)
        if reading is None or state.passed < 4.0:
            continue
        told, own = reading.belief, tracker.filter.belief(state.belief)
        load, health = at["payload"].start, at["z"]
        errors.append([of.mean[load] - PIECE[0] for of in (own, told)])
        np.testing.assert_array_equal(told.mean[health], own.mean[health])
        np.testing.assert_array_equal(told.cov[health, health], own.cov[health, health])
    before, now = np.sqrt(np.mean(np.square(errors), axis=0))
    assert now < (0.7 if elbow == 1.0 else 0.9) * before


@pytest.mark.parametrize("filter_", [EKF(), *QUICKER.values()], ids=["full", *QUICKER])
def test_of_every_gaussian_belief_only_what_is_told_of_the_load_is_better_known(filter_):
    fit, log = carrying(1.0, 6.0)
    tracker = Tracker(fit, filter_, 0.02)
    state = tracker.init()
    for sample in log:
        state, _ = tracker.step(state, sample)
    told, own = tracker.believed(state), tracker.filter.belief(state.belief)
    load = tracker.currents.places["payload"].start + np.arange(LOAD)
    rest = np.setdiff1d(np.arange(len(own.mean)), load)
    assert told.sd[load[0]] < 0.95 * own.sd[load[0]]
    np.testing.assert_array_equal(told.mean[rest], own.mean[rest])
    np.testing.assert_array_equal(told.cov[np.ix_(rest, rest)], own.cov[np.ix_(rest, rest)])
    assert (np.linalg.eigvalsh(told.cov / np.outer(told.sd, told.sd)) > -1e-9).all()


def test_a_cloud_of_particles_is_told_as_it_is():
    tracker = Tracker(commissioned(0)[1], ParticleFilter(64), 0.02)
    state = tracker.init()
    own, told = tracker.filter.belief(state.belief), tracker.believed(state)
    np.testing.assert_array_equal(told.mean, own.mean)
    np.testing.assert_array_equal(told.cov, own.cov)
