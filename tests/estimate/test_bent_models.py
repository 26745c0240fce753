"""Filters where the model is not affine: against quadrature, and against their own definitions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bent_models import Logarithm, Product, Sum

from urdyn.dbn import Tick
from urdyn.estimate import EKF, UKF, ParticleFilter, Variational
from urdyn.estimate.sigma_points import sigma_points
from urdyn.estimate.square_root import SquareRoot
from urdyn.types import Array, Gaussian

MODEL, SEEN, U = Product(), np.array([1.9, 1.2]), Tick()


def predicted() -> Gaussian:
    return Gaussian(MODEL.prior.mean, MODEL.prior.cov + MODEL.transition_cov(U))


def quadrature() -> tuple[Array, Array, float]:
    """Posterior mean, sd and log evidence of one slice, on a grid of 8 sd either side."""
    prior = predicted()
    axes = [m + s * np.linspace(-8, 8, 401) for m, s in zip(prior.mean, prior.sd, strict=True)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    cell = np.prod([a[1] - a[0] for a in axes])
    scores = (x - prior.mean) / prior.sd
    surprise = (SEEN - MODEL.observe(x, U)) / MODEL.noise
    logp = -0.5 * ((scores**2).sum(-1) + (surprise**2).sum(-1))
    scale = (2 * np.pi) ** 2 * np.prod(prior.sd) * MODEL.noise**2
    p = np.exp(logp) * cell / scale
    mean = (p[..., None] * x).sum((0, 1)) / p.sum()
    sd = np.sqrt((p[..., None] * (x - mean) ** 2).sum((0, 1)) / p.sum())
    return mean, sd, float(np.log(p.sum()))


@pytest.mark.parametrize("marginalise", [True, False])
def test_particles_converge_to_the_posterior(marginalise: bool) -> None:
    """Scatter over independent clouds bounds the error of their average."""
    mean, sd, evidence = quadrature()
    ends, evidences = [], []
    for seed in range(12):
        cloud = ParticleFilter(4000, marginalise=marginalise, seed=seed)
        state, surprise = cloud.step(MODEL, cloud.init(MODEL), U, SEEN)
        ends.append(cloud.belief(state).mean)
        evidences.append(surprise.log_likelihood)
    scatter = np.std(ends, axis=0, ddof=1) / np.sqrt(12)
    assert (np.abs(np.mean(ends, axis=0) - mean) < 5.9 * scatter).all()
    assert (scatter < 0.02 * sd).all()
    assert abs(np.mean(evidences) - evidence) < 5.9 * np.std(evidences, ddof=1) / np.sqrt(12)


def test_what_is_marginalised_scatters_less() -> None:
    def scatter(marginalise: bool) -> Array:
        ends = []
        for seed in range(30):
            cloud = ParticleFilter(300, marginalise=marginalise, seed=seed)
            state, _ = cloud.step(MODEL, cloud.init(MODEL), U, SEEN)
            ends.append(cloud.belief(state).mean)
        return np.std(ends, axis=0)

    assert (scatter(True) < scatter(False)).all()


@pytest.mark.parametrize("filter_", [EKF(iterations=10), Variational()], ids=repr)
def test_iteration_comes_close_to_the_posterior(filter_: Any) -> None:
    """Within half a posterior sd: what is left is the posterior's skew, which no Gaussian has."""
    mean, sd, _ = quadrature()
    state, _ = filter_.step(MODEL, filter_.init(MODEL), U, SEEN)
    assert (np.abs(filter_.belief(state).mean - mean) < 0.5 * sd).all()


@pytest.mark.parametrize("filter_", [UKF(), UKF(alpha=0.5), UKF("simplex")], ids=repr)
def test_sigma_points_know_that_they_have_not_come_close(filter_: UKF) -> None:
    """One step from a wide prior, two of its sd off: the model's curvature counts as noise."""
    mean, sd, _ = quadrature()
    state, _ = filter_.step(MODEL, filter_.init(MODEL), U, SEEN)
    belief = filter_.belief(state)
    assert (np.abs(belief.mean - mean) < belief.sd).all()
    assert belief.sd[0] > sd[0]


@pytest.mark.parametrize("idle", [1, 10, 120])
def test_what_else_is_unknown_does_not_change_what_is_learnt_of_a_logarithm(idle: int) -> None:
    """Points of many states lie no further out: there its exponential is beyond all that it is.

    The centre's share of the curvature, 2 - 3 / n, is from half to all of what the points show of
    it, .047 beside a slope squared of .32: a tenth of what is learnt.
    """

    def learnt(states: int) -> tuple[float, float]:
        model = Logarithm(states)
        state, _ = UKF().step(model, UKF().init(model), U, np.array([1.3]))
        belief = UKF().belief(state)
        return float(belief.mean[0]), float(belief.sd[0])

    assert np.allclose(learnt(3 + idle), learnt(3), rtol=0.1)


def test_an_iterated_ekf_ends_at_the_most_probable_state() -> None:
    ekf, prior = EKF(iterations=50), predicted()
    state, _ = ekf.step(MODEL, ekf.init(MODEL), U, SEEN)
    H = MODEL.observe_jacobian(state.mean, U)
    pull = H.T @ (SEEN - MODEL.observe(state.mean, U)) / MODEL.noise**2
    np.testing.assert_allclose(pull, (state.mean - prior.mean) / prior.sd**2, rtol=1e-6)


def test_variational_inference_ends_where_its_gradient_is_zero() -> None:
    vi, prior = Variational(iterations=200, tolerance=1e-12), predicted()
    q, _ = vi.step(MODEL, vi.init(MODEL), U, SEEN)
    points = sigma_points(2, "merwe", 1.0, 2.0, 0.0)
    x = q.at(points.unit)
    H, residual = MODEL.observe_jacobian(x, U), SEEN - MODEL.observe(x, U)
    pull = np.einsum("k,krn,kr->n", points.mean_weight, H, residual) / MODEL.noise**2
    np.testing.assert_allclose(pull, (q.mean - prior.mean) / prior.sd**2, rtol=1e-6)
    H = np.tensordot(points.mean_weight, H, axes=1)
    precision = H.T @ H / MODEL.noise**2
    np.testing.assert_allclose(
        np.linalg.inv(q.gaussian.cov), precision + np.diag(1 / prior.sd**2), rtol=1e-6
    )


def test_variational_inference_does_not_leave_its_start_for_what_is_worse() -> None:
    """KL(q || posterior) of sums of eighty exponentials, in closed form, beside that of UKF."""
    rng, vi = np.random.default_rng(3), Variational()
    model, u = Sum(rng.standard_normal((4, 80))), Tick()
    state = vi.init(model)
    for row in range(4):
        y = np.where(np.arange(4) == row, rng.standard_normal(4), np.nan)
        ukf, _ = UKF().step(model, state.gaussian, u, y)
        after, _ = vi.step(model, state, u, y)
        here, begun = (model.divergence(q, state.gaussian, y) for q in (after.gaussian, ukf))
        assert here <= begun + 1e-6
        state = after


def test_a_square_root_belief_survives_singular_covariances() -> None:
    flat = np.outer([1.0, 2.0, 0.0], [1.0, 2.0, 0.0])
    belief = SquareRoot.of(np.zeros(3), flat)
    np.testing.assert_allclose(belief.gaussian.cov, flat, atol=1e-13)


def test_variational_inference_begins_where_ukf_ends_though_the_process_bends() -> None:
    class Squared(Product):
        affine_transition = False

        def transition(self, x: Array, u: Tick) -> Array:
            return x**2

    model, nothing = Squared(), np.full(2, np.nan)
    ukf, _ = UKF().step(model, model.prior, U, nothing)
    q, _ = Variational().step(model, Variational().init(model), U, nothing)
    np.testing.assert_allclose(q.gaussian.mean, ukf.mean)
    np.testing.assert_allclose(q.gaussian.cov, ukf.cov)
