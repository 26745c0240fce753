"""Oracle: smoothing is conditioning the joint Gaussian of all states on all observations."""

from __future__ import annotations

import numpy as np
import pytest
from affine_models import Model, random_model, simulate, ticks

from urdyn.dbn import Tick
from urdyn.estimate import FixedLag, Kalman, smooth, track
from urdyn.types import Array, Gaussian

N, STATES = 8, 3


@pytest.fixture(scope="module")
def life() -> tuple[Model, Array]:
    rng = np.random.default_rng(21)
    model = random_model(rng, STATES, 2)
    observations = simulate(model, ticks(N), rng)[1]
    observations[2, 0] = np.nan
    observations[5] = np.nan
    return model, observations


def dense(model: Model, observations: Array) -> Gaussian:
    """All N + 1 states given all observations, by one solve."""
    u, n, zero = Tick(), STATES, np.zeros(STATES)
    F, Q, b = model.transition_jacobian(zero, u), model.transition_cov(u), model.transition(zero, u)
    H, R, d = model.observe_jacobian(zero, u), model.observe_cov(u), model.observe(zero, u)
    size = n * (N + 1)
    own, difference, shift = np.zeros((size, size)), np.eye(size), np.zeros(size)
    for t in range(N + 1):
        here = slice(n * t, n * t + n)
        own[here, here] = model.prior.cov if t == 0 else Q
        shift[here] = model.prior.mean if t == 0 else b
        if t:
            difference[here, n * t - n : n * t] = -F
    spread = np.linalg.inv(difference)
    mean, cov = spread @ shift, spread @ own @ spread.T
    C, noise = np.kron(np.eye(N + 1)[1:], H), np.kron(np.eye(N), R)
    seen = np.isfinite(observations).ravel()
    C, noise = C[seen], noise[np.ix_(seen, seen)]
    residual = observations.ravel()[seen] - C @ mean - np.tile(d, N)[seen]
    K = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + noise)
    return Gaussian(mean + K @ residual, cov - K @ C @ cov)


def test_smoothing_is_conditioning_the_joint_gaussian(life: tuple[Model, Array]) -> None:
    model, observations = life
    found, log_likelihood = smooth(model, ticks(N), observations)
    wanted = dense(model, observations)
    blocks = wanted.cov.reshape(N + 1, STATES, N + 1, STATES)
    np.testing.assert_allclose(found.mean, wanted.mean.reshape(N + 1, STATES), rtol=1e-8)
    for t in range(N + 1):
        np.testing.assert_allclose(found.cov[t], blocks[t, :, t], rtol=1e-8, atol=1e-10)
    for t in range(N):
        np.testing.assert_allclose(found.cross[t], blocks[t + 1, :, t], rtol=1e-8, atol=1e-10)
    filtered = track(Kalman(), model, ticks(N), observations).log_likelihood
    assert log_likelihood == pytest.approx(filtered, rel=1e-12)


@pytest.mark.parametrize("lag", [0, 1, 3])
def test_a_fixed_lag_is_the_smoother_of_what_has_been_seen(
    lag: int, life: tuple[Model, Array]
) -> None:
    model, observations = life
    lagged = track(FixedLag(lag), model, ticks(N), observations)
    for t in range(lag, N):
        wanted, _ = smooth(model, ticks(t + 1), observations[: t + 1])
        np.testing.assert_allclose(lagged.mean[t], wanted.mean[t + 1 - lag], rtol=1e-9)
        np.testing.assert_allclose(lagged.sd[t], wanted.sd[t + 1 - lag], rtol=1e-9)
