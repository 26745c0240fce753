"""Oracle: smoothing is conditioning the joint Gaussian of all states on all observations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import Model, random_cov, random_model, simulate, ticks

from urdyn.dbn import (
    AffineObservation,
    Edge,
    Joined,
    Network,
    Node,
    Process,
    Smoothed,
    Tick,
    Trend,
    compile_linear,
    learn_network,
)
from urdyn.estimate import FixedLag, Kalman, smooth, track
from urdyn.estimate.square_root import JITTER
from urdyn.types import Array, Gaussian

VAGUE = 1e10  # variance of a prior beside readings of variance 1
# A reading without noise is given the rounding of what is expected of it: that of a vague prior, of
# a level and its rate, is added to the first readings' 1; without noise its row stands so far out.
BESIDE_VAGUE, BESIDE_EXACT = 2.0 * JITTER * VAGUE, 10.0 * np.finfo(float).eps / JITTER**0.5
FADING = Network(
    (Node("f", sd=0.1, time_constant=30.0), Node("a", sd=0.1, time_constant=5.0)),
    (Edge("f", "a", 0.5),),
)
SIZES = {"f": 1, "a": 1}


def first_seen(process: Process[Any], R: float) -> Model:
    """The first of two states, measured with a variance of R."""
    return Joined(process, AffineObservation(2, lambda u: np.array([[1.0, 0.0]]), R * np.eye(1)))


def one_exact(rng: np.random.Generator) -> Model:
    """Three sensors, the first without noise."""
    process, H = random_model(rng, 3, 1).process, rng.standard_normal((3, 3))
    R = np.zeros((3, 3))
    R[1:, 1:] = random_cov(rng, 2)
    return Joined(process, AffineObservation(3, lambda u: H, R))


VAGUE_TREND = Trend(
    ("f",),
    Gaussian(np.zeros(1), VAGUE * np.eye(1)),
    np.array([0.01]),
    np.array([0]),
    np.array([VAGUE**0.5]),
    np.array([1e-3]),
)
# What a smoother bears, and how near to the oracle, in standard deviations, rounding lets it come.
MODELS: dict[str, tuple[Model, float]] = {
    "random": (random_model(np.random.default_rng(21), 3, 2), 1e-8),
    "no process noise": (first_seen(compile_linear(FADING, SIZES), 0.01), 1e-8),
    "a vague prior": (first_seen(VAGUE_TREND, 1.0), BESIDE_VAGUE),
    "a sensor without noise": (one_exact(np.random.default_rng(22)), BESIDE_EXACT),
}


@pytest.fixture(scope="module", params=MODELS)
def life(request: pytest.FixtureRequest) -> tuple[Model, Array, float]:
    model, near = MODELS[request.param]
    count = 100 if request.param == "no process noise" else 12
    observations = simulate(model, ticks(count), np.random.default_rng(23))[1]
    observations[2, 0] = np.nan
    observations[5] = np.nan
    return model, observations, near


def root_of(cov: Array) -> Array:
    value, vector = np.linalg.eigh(cov)
    return np.asarray(vector * np.sqrt(np.maximum(value, 0.0)))


def dense(model: Model, observations: Array) -> Smoothed:
    """All N + 1 states are affine in noises of variance 1, of which the readings A z = r tell."""
    (N, m), n, u = observations.shape, len(model.names), Tick()
    zero, noises = np.zeros(n), np.eye((N + 1) * (n + m)).reshape(N + 1, n + m, -1)
    F, d = model.transition_jacobian(zero, u), model.observe(zero, u)
    H = model.observe_jacobian(zero, u)
    Q, V = root_of(model.transition_cov(u)), root_of(model.observe_cov(u))
    means, spreads = [model.prior.mean], [root_of(model.prior.cov) @ noises[0, :n]]
    for noise in noises[1:]:
        means.append(model.transition(means[-1], u))
        spreads.append(F @ spreads[-1] + Q @ noise[:n])
    mean, spread = np.array(means), np.array(spreads)
    seen = np.isfinite(observations)
    A = (H @ spread[1:] + V @ noises[1:, n:])[seen]
    r = (observations - mean[1:] @ H.T - d)[seen]
    turned, R = np.linalg.qr(A.T, mode="complete")
    known, left = turned[:, : len(r)], spread @ turned[:, len(r) :]
    across = np.swapaxes(left, 1, 2)
    z = known @ np.linalg.solve(R[: len(r)].T, r)
    return Smoothed(mean + spread @ z, left @ across, left[1:] @ across[:-1])


def test_smoothing_is_conditioning_the_joint_gaussian(life: tuple[Model, Array, float]) -> None:
    model, observations, near = life
    inputs = ticks(len(observations))
    found, log_likelihood = smooth(model, inputs, observations)
    wanted = dense(model, observations)
    sd = wanted.sd + near  # where a sensor tells all, none is left
    assert (np.abs(found.mean - wanted.mean) < near * sd).all()
    for one, other, unit in (
        (found.cov, wanted.cov, sd[:, :, None] * sd[:, None]),
        (found.cross, wanted.cross, sd[1:, :, None] * sd[:-1, None]),
    ):
        assert (np.abs(one - other) < near * unit).all()
    filtered = track(Kalman(), model, inputs, observations)
    assert log_likelihood == pytest.approx(filtered.log_likelihood, rel=1e-12)
    before = np.vstack([model.prior.sd, filtered.sd])
    assert (found.sd <= before * (1.0 + near) + near).all()


def test_em_learns_what_the_joint_gaussian_tells_of_a_network_without_noise() -> None:
    model, _ = MODELS["no process noise"]
    inputs = ticks(100)
    observations = simulate(model, inputs, np.random.default_rng(24))[1]
    found, wanted = (
        learn_network(FADING, SIZES, history, np.ones(100))
        for history in (smooth(model, inputs, observations)[0], dense(model, observations))
    )
    for one, other in zip(found.nodes, wanted.nodes, strict=True):
        np.testing.assert_allclose(one.diffusion, other.diffusion, rtol=1e-6)


@pytest.mark.parametrize("lag", [0, 1, 3])
def test_a_fixed_lag_is_the_smoother_of_what_has_been_seen(
    lag: int, life: tuple[Model, Array, float]
) -> None:
    model, observations = life[0], life[1][:12]
    lagged = track(FixedLag(lag), model, ticks(12), observations)
    for t in range(lag, 12):
        wanted, _ = smooth(model, ticks(t + 1), observations[: t + 1])
        np.testing.assert_allclose(lagged.mean[t], wanted.mean[t + 1 - lag], rtol=1e-9)
        np.testing.assert_allclose(lagged.sd[t], wanted.sd[t + 1 - lag], rtol=1e-9)
