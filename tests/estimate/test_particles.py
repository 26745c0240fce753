"""Clouds in which readings leave few particles, and states that nothing moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from affine_models import Regressors, random_model
from bent_models import Product

from urdyn.dbn import AffineObservation, Joined, RandomWalk, Tick
from urdyn.estimate import Kalman, ParticleFilter, track
from urdyn.types import Array, Gaussian


def still(n: int, noise: float, r: int) -> Joined[Regressors]:
    """States of unit variance that nothing moves, of which r sums are seen."""
    names = tuple(f"x{k}" for k in range(n))
    prior = Gaussian(np.zeros(n), np.eye(n))
    seen = AffineObservation[Regressors](n, lambda u: u.Y, noise**2 * np.eye(r))
    return Joined(RandomWalk(names, prior, np.zeros(n)), seen)


@pytest.mark.parametrize("noise", [1.0, 0.1, 0.01])
def test_what_is_learnt_bit_by_bit_is_as_likely_as_at_once(noise: float) -> None:
    """Of particles by themselves, one in a hundred lies where a sharp reading is."""
    model, looks, y = still(1, noise, 1), [Regressors(np.ones((1, 1)))], np.array([[1.3]])
    exact = track(Kalman(), model, looks, y)
    gaps = []
    for seed in range(20):
        cloud = ParticleFilter(2000, marginalise=False, seed=seed)
        found = track(cloud, model, looks, y)
        told, due = found.innovations[0].log_likelihood, exact.innovations[0].log_likelihood
        gaps.append([told - due, (found.mean[0, 0] - exact.mean[0, 0]) / exact.sd[0, 0]])
    # A round leaves a quarter of them: the error of its mean is some 2 / sqrt(2000), of ten rounds
    # at most; of the mean of twenty seeds a fourth of that, and five of those are allowed.
    assert np.abs(np.mean(gaps, axis=0)).max() < 5.0 * np.sqrt(10.0) * 2.0 / np.sqrt(20 * 2000)


@pytest.mark.parametrize("seed", range(4))
def test_states_that_nothing_moves_do_not_become_copies_of_one(seed: int) -> None:
    """Two hundred sharp readings, each of which few particles outlive."""
    rng, n, r, noise = np.random.default_rng(seed), 8, 3, 0.2
    model, x = still(n, noise, r), rng.standard_normal(n)
    looks = [Regressors(rng.standard_normal((r, n))) for _ in range(200)]
    y = np.array([look.Y @ x + noise * rng.standard_normal(r) for look in looks])
    exact = track(Kalman(), model, looks, y)
    found = track(ParticleFilter(1000, marginalise=False), model, looks, y)
    off = (found.mean[-1] - exact.mean[-1]) / exact.sd[-1]
    assert np.sqrt(np.mean(off**2)) < 1.0  # less than the error that both have
    assert 0.7 < np.median(found.sd[-1] / exact.sd[-1]) < 1.2


@pytest.mark.parametrize("model", [Product(), random_model(np.random.default_rng(0), 4, 2)])
def test_one_covariance_serves_all_particles_unless_more_are_asked_for(model: Any) -> None:
    """It is zero where all states are sampled, and Kalman's where none is."""
    cloud, y = ParticleFilter(9), np.ones(2)
    state, _ = cloud.step(model, cloud.init(model), Tick(), y)
    assert len(state.cov) == 1
    exact, _ = Kalman().step(model, model.prior, Tick(), y)
    np.testing.assert_allclose(state.cov[0], exact.cov if model.linear.all() else 0.0)


@dataclass(frozen=True, eq=False)
class Square:
    """y = x² + e, that leaves two modes."""

    linear = np.zeros(1, dtype=bool)

    def observe(self, x: Array, u: Tick) -> Array:
        return x**2

    def observe_jacobian(self, x: Array, u: Tick) -> Array:
        return 2.0 * x[..., None]

    def observe_cov(self, u: Tick) -> Array:
        return np.eye(1)


def test_two_modes_stay_apart_where_particles_stay_near_where_they_were() -> None:
    """Thirty readings of 1 leave 1 and -1, give or take .1, and nothing between them."""
    walk = RandomWalk(("x",), Gaussian(np.zeros(1), np.eye(1)), np.zeros(1))
    model, cloud = Joined(walk, Square()), ParticleFilter(2000, kept=0.97)
    state = cloud.init(model)
    for _ in range(30):
        state, _ = cloud.step(model, state, Tick(), np.ones(1))
    weight = np.exp(state.log_weight)
    assert weight @ np.abs(state.x[:, 0]) == pytest.approx(1.0, abs=0.1)
