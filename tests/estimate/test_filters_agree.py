"""Oracle: on an affine model every filter is Kalman's, and Kalman's is filterpy's."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from affine_models import EXACT, Model, random_model, simulate, ticks

from urdyn.dbn import Tick
from urdyn.estimate import Consider, Kalman, ParticleFilter, track
from urdyn.types import Array

N, STATES, SENSORS = 40, 5, 3


def filterpy_track(model: Model, observations: Array) -> tuple[Array, Array, float]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what filterpy imports
        from filterpy.kalman import KalmanFilter
    u, x = Tick(), model.prior.mean
    kf = KalmanFilter(STATES, SENSORS, STATES)
    kf.x, kf.P = x.copy(), model.prior.cov.copy()
    kf.F, kf.Q, kf.B = model.transition_jacobian(x, u), model.transition_cov(u), np.eye(STATES)
    kf.H, kf.R = model.observe_jacobian(x, u), model.observe_cov(u)
    b, d = model.transition(0 * x, u), model.observe(0 * x, u)
    means, sds, log_likelihood = [], [], 0.0
    for y in observations:
        kf.predict(u=b)
        kf.update(y - d)
        means.append(kf.x.copy())
        sds.append(np.sqrt(np.diag(kf.P)))
        log_likelihood += kf.log_likelihood
    return np.array(means), np.array(sds), log_likelihood


@pytest.fixture(scope="module")
def life() -> tuple[Model, Array]:
    rng = np.random.default_rng(3)
    model = random_model(rng, STATES, SENSORS)
    return model, simulate(model, ticks(N), rng)[1]


@pytest.mark.parametrize("filter_", EXACT, ids=repr)
def test_every_filter_is_kalman_on_an_affine_model(filter_: Any, life: tuple[Model, Array]) -> None:
    model, observations = life
    means, sds, log_likelihood = filterpy_track(model, observations)
    found = track(filter_, model, ticks(N), observations)
    # Rounding of 1e-16, raised by 1/alpha² = 1e4 where sigma points are drawn that close.
    np.testing.assert_allclose(found.mean / sds, means / sds, atol=1e-9)
    np.testing.assert_allclose(found.sd, sds, rtol=1e-9)
    assert found.log_likelihood == pytest.approx(log_likelihood, rel=1e-9)


def test_a_cloud_of_particles_is_kalman_up_to_its_own_scatter(life: tuple[Model, Array]) -> None:
    """Student's t over independent clouds; 1/K of bias is small beside 1/sqrt(K) of scatter."""
    model, observations = life
    clouds, steps = 12, 10
    exact = track(Kalman(), model, ticks(steps), observations[:steps])
    found = np.array(
        [
            track(
                ParticleFilter(1000, marginalise=False, seed=seed),
                model,
                ticks(steps),
                observations[:steps],
            ).mean[-1]
            for seed in range(clouds)
        ]
    )
    scatter = found.std(axis=0, ddof=1) / np.sqrt(clouds)
    t = (found.mean(axis=0) - exact.mean[-1]) / scatter
    assert np.abs(t).max() < 5.9  # 1 in 10,000 with 11 degrees of freedom
    assert (scatter * np.sqrt(clouds) < 0.3 * exact.sd[-1]).all()


def test_a_filter_that_may_learn_everything_considers_nothing(life: tuple[Model, Array]) -> None:
    model, observations = life
    exact = track(Kalman(), model, ticks(N), observations)
    found = track(Consider(frozenset(model.names)), model, ticks(N), observations)
    np.testing.assert_allclose(found.mean, exact.mean)
    np.testing.assert_allclose(found.sd, exact.sd)
