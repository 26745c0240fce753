"""Wear is told from what a healthy arm does, by its likelihood, and gets back what others took."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from workshop import commissioned

from urdyn.dbn.wear import Fading, Jolt, Wear
from urdyn.estimate import EKF
from urdyn.tracking import Tracker
from urdyn.tracking.belief.model import JOLTS
from urdyn.tracking.step.past_beliefs import ROLLBACK
from urdyn.tracking.step.wear_test import ASKED, SURE, WearOdds, WearTest
from urdyn.types import Gaussian

J, OTHERS = 2, 3
PLACES = {group: slice(k * J, (k + 1) * J) for k, group in enumerate(JOLTS)}
DRIVES = J * len(JOLTS)
LASTING = DRIVES + OTHERS
PLACES |= {"payload": slice(LASTING, LASTING + 1), "slow": slice(LASTING + 1, LASTING + 2)}
STATES = LASTING + 2
WALK = 1e-3  # [1/s] variance that each drive's parameters gather in a second
SPAN = 30.0  # [s]
STEP = 0.5  # [s]


def prior_of(rng: np.random.Generator) -> Gaussian:
    """Of drives and other states that hang together, and of what is not what it was, alone."""
    root = np.zeros((STATES, STATES))
    root[:LASTING, :LASTING] = 0.03 * (np.eye(LASTING) + 0.3 * rng.standard_normal((LASTING,) * 2))
    root[LASTING:, LASTING:] = np.diag([3.0, 0.5])
    return Gaussian(0.1 * rng.standard_normal(STATES), root @ root.T)


def asked(walk: float = 0.0) -> WearTest:
    """Of drives that stray, or do not, and have no rates."""
    own = np.diag(np.where(np.arange(STATES) < DRIVES, walk, 0.0))
    nothing, none = np.zeros((STATES, STATES)), np.zeros(0, dtype=np.intp)
    still = Fading(slice(0, 0), 1.0, 0.0)
    jolts = tuple(Jolt(PLACES[group], sd) for group, sd in JOLTS.items())
    wear = Wear(
        tuple(map(str, range(STATES))), Gaussian(np.zeros(STATES), np.eye(STATES)), own, none,
        np.zeros((0, 0)), nothing, np.zeros(STATES), (still,), jolts, PLACES["payload"],
        PLACES["slow"], slice(0, 0), 1.0,
    )  # fmt: skip
    return WearTest(wear)


def test_what_fades_while_a_rate_leads_it_moves_as_its_jacobian_says() -> None:
    """The process is linear: it is what becomes of each unit vector."""
    fading, unit = Fading(slice(0, DRIVES), SPAN, 0.1), np.eye(STATES + 1)
    led = {"drifting": np.zeros(1, dtype=np.intp), "push": np.eye(1), "fading": (fading,)}
    wear = replace(asked().wear, prior=Gaussian(unit[0], unit), **led)
    u = SimpleNamespace(span=STEP)
    F = wear.transition_jacobian(unit[0], u)
    np.testing.assert_allclose(F, wear.transition(unit, u).T, rtol=1e-14)


def test_two_changes_that_befall_the_same_states_are_as_wide_as_both() -> None:
    wear, known = asked().wear, Gaussian(np.zeros(STATES), np.zeros((STATES, STATES)))
    twice = replace(wear, jolts=(*wear.jolts, *wear.jolts))
    one, both = (of.befallen(known, np.ones(1), False).cov for of in (wear, twice))
    assert one.any()
    np.testing.assert_allclose(both, 2.0 * one)


def told(before: Gaussian, now: Gaussian) -> WearOdds:
    """Of drives that do not stray."""
    return asked().compared(before, now, SPAN, False)


def seen(prior: Gaussian, cov: np.ndarray, H: np.ndarray, y: np.ndarray) -> tuple[Gaussian, float]:
    """What measurements with a noise of 1 leave of the prior with this covariance, and log p(y)."""
    S = H @ cov @ H.T + np.eye(len(y))
    gain, e = cov @ H.T @ np.linalg.inv(S), y - H @ prior.mean
    likelihood = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(S)[1])
    return Gaussian(prior.mean + gain @ e, cov - gain @ H @ cov), float(likelihood)


def wider(prior: Gaussian, j: int) -> np.ndarray:
    """Its covariance, where this drive may have worn besides."""
    cov = np.array(prior.cov)
    for group, sd in JOLTS.items():
        at = PLACES[group].start + j
        cov[at, at] += sd**2
    return cov


def measured(seed: int) -> tuple[Gaussian, np.ndarray, np.ndarray]:
    """A prior, what measurements see, and what they were."""
    rng = np.random.default_rng(seed)
    prior = prior_of(rng)
    H = 20.0 * rng.standard_normal((30, STATES))
    H[:, rng.integers(LASTING)] = 0.0  # nobody sees this one
    y = H @ (prior.mean + 0.1 * rng.standard_normal(STATES)) + rng.standard_normal(30)
    return prior, H, y


def test_what_is_known_less_well_than_before_was_not_measured_and_did_not_wear() -> None:
    """However far its mean lies off: it strayed, and nobody saw where to."""
    before = prior_of(np.random.default_rng(1))
    off = before.mean + np.where(np.arange(STATES) < DRIVES, 1.0, 0.0)
    odds = told(before, Gaussian(off, 1.5 * before.cov))
    np.testing.assert_array_equal(odds.log_odds, 0.0)
    assert not odds.worse.any() and not odds.wore(0.0).any()


@pytest.mark.parametrize("seed", range(10))
def test_a_belief_tells_what_two_priors_make_of_all_measurements(seed: int) -> None:
    """The ratio of both marginal likelihoods, by the posterior of one of them."""
    prior, H, y = measured(seed)
    belief, healthy = seen(prior, prior.cov, H, y)
    for j, odds in enumerate(told(prior, belief).log_odds):
        np.testing.assert_allclose(
            odds, seen(prior, wider(prior, j), H, y)[1] - healthy, rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("j", range(J))
def test_a_belief_tells_what_who_allowed_for_wear_believes(seed: int, j: int) -> None:
    """As if every measurement had been learnt from with the other prior."""
    prior, H, y = measured(seed)
    belief, _ = seen(prior, prior.cov, H, y)
    wanted, _ = seen(prior, wider(prior, j), H, y)
    found = told(prior, belief).allowing(np.arange(J) == j)
    np.testing.assert_allclose(found.mean, wanted.mean, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.cov, wanted.cov, rtol=1e-5, atol=1e-9)


def test_nothing_seen_and_nothing_but_drift_is_nothing_found() -> None:
    prior = prior_of(np.random.default_rng(1))
    np.testing.assert_allclose(told(prior, prior).log_odds, 0.0, atol=1e-9)
    drifted = Gaussian(prior.mean, 1.05 * prior.cov)
    np.testing.assert_allclose(told(prior, drifted).log_odds, 0.0, atol=1e-9)


def test_what_a_healthy_drive_strays_by_is_no_wear() -> None:
    """Two sd of what it strays by, measured well, is found by who forgets that; ten by all."""
    prior = Gaussian(np.zeros(STATES), 1e-8 * np.eye(STATES))
    strayed = 2.0 * np.sqrt(WALK * SPAN) * np.eye(STATES)[0]
    now = Gaussian(strayed, 1e-9 * np.eye(STATES))
    assert told(prior, now).wore()[0]
    assert not asked(WALK).compared(prior, now, SPAN, False).wore().any()
    assert asked(WALK).compared(prior, replace(now, mean=5.0 * strayed), SPAN, False).wore()[0]


def test_one_drive_is_found_at_a_time_and_none_that_is_better() -> None:
    """Its neighbour's belief is bent by it until it is known."""
    rng = np.random.default_rng(2)
    prior = prior_of(rng)
    H = 50.0 * rng.standard_normal((60, STATES))
    for sign in (1.0, -1.0):
        truth = np.array(prior.mean)
        truth[[0, 1]] += sign * 1.0, sign * 0.8  # f of both
        y = H @ truth + rng.standard_normal(60)
        both = told(prior, seen(prior, prior.cov, H, y)[0])
        assert (both.log_odds > SURE).all()
        assert both.wore().sum() == (sign > 0.0)
    truth[[0, 1]] += 2.0, 1.6
    y = H @ truth + rng.standard_normal(60)
    first = told(prior, seen(prior, prior.cov, H, y)[0]).wore()
    known = Gaussian(prior.mean, wider(prior, int(np.flatnonzero(first)[0])))
    again = told(known, seen(known, known.cov, H, y)[0])
    assert (again.wore() == ~first).all()


@pytest.mark.parametrize("sets_off", [1.0, 1.5, np.inf])
def test_a_belief_of_half_a_minute_to_a_minute_ago_is_kept_however_often_the_arm_stands(
    sets_off: float,
) -> None:
    _, fit = commissioned(0)
    past = Tracker(fit, EKF(), STEP).init().past
    point = past.rollback
    for t in np.arange(0.0, 200.0, STEP):
        if t % sets_off < STEP and t > 0.0:
            past = past.marked_by(point, point, t, t, t)
        elif past.due(t):
            past = past.marked_by(point, past.next_rollback, t, t, t)
        if t > 2.0 * ASKED + ROLLBACK:
            assert ASKED - STEP <= t - past.reference.moved <= 2.0 * (ASKED + ROLLBACK)
