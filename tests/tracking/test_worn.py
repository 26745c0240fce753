"""Wear before a run is told from what a healthy arm's days do, by its likelihood."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.tracking.model import JOLTS
from urdyn.tracking.worn import SURE, Worn
from urdyn.types import Gaussian

J, OTHERS = 2, 3
PLACES = {group: slice(k * J, (k + 1) * J) for k, group in enumerate(JOLTS)}
STATES = J * len(JOLTS) + OTHERS


def prior_of(rng: np.random.Generator) -> Gaussian:
    """Of drives and of other states that hang together with them."""
    root = 0.03 * (np.eye(STATES) + 0.3 * rng.standard_normal((STATES, STATES)))
    return Gaussian(0.1 * rng.standard_normal(STATES), root @ root.T)


def seen(prior: Gaussian, cov: np.ndarray, H: np.ndarray, y: np.ndarray) -> tuple[Gaussian, float]:
    """What measurements with a noise of 1 leave of the prior with this covariance, and log p(y)."""
    S = H @ cov @ H.T + np.eye(len(y))
    gain, e = cov @ H.T @ np.linalg.inv(S), y - H @ prior.mean
    likelihood = -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(S)[1])
    return Gaussian(prior.mean + gain @ e, cov - gain @ H @ cov), float(likelihood)


@pytest.mark.parametrize("seed", range(10))
def test_a_belief_tells_what_two_priors_make_of_all_measurements(seed: int) -> None:
    """The ratio of both marginal likelihoods, by the posterior of one of them."""
    rng = np.random.default_rng(seed)
    prior = prior_of(rng)
    H = 20.0 * rng.standard_normal((30, STATES))
    H[:, rng.integers(STATES)] = 0.0  # nobody sees this one
    y = H @ (prior.mean + 0.1 * rng.standard_normal(STATES)) + rng.standard_normal(30)
    belief, healthy = seen(prior, prior.cov, H, y)
    worn = Worn.of(prior, PLACES)
    for j, odds in enumerate(worn.log_odds(belief)):
        wider = np.array(prior.cov)
        for group, sd in JOLTS.items():
            at = PLACES[group].start + j
            wider[at, at] += sd**2
        np.testing.assert_allclose(
            odds, seen(prior, wider, H, y)[1] - healthy, rtol=1e-6, atol=1e-6
        )


def test_nothing_seen_and_nothing_but_drift_is_nothing_found() -> None:
    prior = prior_of(np.random.default_rng(1))
    worn = Worn.of(prior, PLACES)
    np.testing.assert_allclose(worn.log_odds(prior), 0.0, atol=1e-9)
    drifted = Gaussian(prior.mean, 1.05 * prior.cov)
    np.testing.assert_allclose(worn.log_odds(drifted), 0.0, atol=1e-9)


def test_one_drive_is_found_at_a_time_and_none_that_is_not_asked() -> None:
    """Its neighbour's belief is bent by it until it is known."""
    rng = np.random.default_rng(2)
    prior = prior_of(rng)
    worn = Worn.of(prior, PLACES)
    H = 50.0 * rng.standard_normal((60, STATES))
    truth = np.array(prior.mean)
    truth[[0, 1]] += 1.0, 0.8  # f of both
    belief, _ = seen(prior, prior.cov, H, H @ truth + rng.standard_normal(60))
    assert (worn.log_odds(belief) > SURE).all()
    asked = np.ones(J, dtype=bool)
    first = worn.found(belief, asked)
    assert first.sum() == 1
    assert not worn.found(belief, ~asked).any()
    assert (worn.found(belief, ~first) == ~first).all()
