"""The posterior Cramer-Rao bound: exact where Kalman's filter is, and beaten by none elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import random_model, simulate, ticks
from bent_models import Product

from urdyn.dbn import Joined, Tick, Trend
from urdyn.dbn.affine import AffineObservation
from urdyn.errors import UrdynError
from urdyn.estimate import UKF, Kalman, ParticleFilter, posterior_bound, ramp_bound, track
from urdyn.types import Array, Gaussian

STEPS = 30


@pytest.mark.parametrize("sensors", [1, 3, 8])  # fewer rows than states, and more
def test_on_an_affine_model_the_bound_is_kalmans_covariance(sensors: int) -> None:
    rng = np.random.default_rng(1)
    model = random_model(rng, 5, sensors)
    _, seen = simulate(model, ticks(STEPS), rng)
    seen = np.where(rng.random(seen.shape) < 0.2, np.nan, seen)
    found = posterior_bound(model, ticks(STEPS), seen)
    exact = track(Kalman(), model, ticks(STEPS), seen)
    np.testing.assert_allclose(found.sd, exact.sd, rtol=1e-9)


@pytest.mark.parametrize(
    ("filter_", "lives"),
    [
        pytest.param(UKF(), 60, id="ukf"),
        pytest.param(ParticleFilter(200), 20, id="a few of particles"),
        pytest.param(ParticleFilter(200), 60, id="particles", marks=pytest.mark.slow),
    ],
)
def test_no_filter_beats_the_bound_of_a_model_that_bends(filter_: Any, lives: int) -> None:
    """Mean squares over lives of the model, in units of the bound's, with four of their sd."""
    model, rng = Product(sd=0.1), np.random.default_rng(2)
    bound = posterior_bound(model, ticks(STEPS), rng=rng)
    squares: list[Array] = []
    for _ in range(lives):
        states, seen = simulate(model, ticks(STEPS), rng)  # type: ignore[arg-type]
        squares.append((track(filter_, model, ticks(STEPS), seen).mean - states) ** 2)
    ratio = (np.array(squares) / bound.sd**2).mean(axis=1)
    scatter = ratio.std(axis=0, ddof=1) / np.sqrt(lives)
    assert (ratio.mean(axis=0) > 1.0 - 4.0 * scatter).all()
    assert (ratio.mean(axis=0) < 1.2 + 4.0 * scatter).all()  # and it is not far below them


def test_lives_that_are_given_are_what_is_averaged_over() -> None:
    """One life at the prior's mean: Kalman's covariance of the model linearised there."""
    model = Product(wander=0.0)
    lives = np.tile(model.prior.mean, (3, 1, 1))
    found = posterior_bound(model, ticks(3), lives=lives)
    H = model.observe_jacobian(model.prior.mean, Tick())
    information = np.linalg.inv(model.prior.cov) + 3.0 * H.T @ H / model.noise**2
    np.testing.assert_allclose(found.cov, np.linalg.inv(information), rtol=1e-9)


def test_a_ramp_from_a_known_step_is_bounded_as_a_trend_from_there() -> None:
    """Level alone up to the onset, then level and rate: the recursion and the closed form."""
    sigma, level_sd, rate_sd, onset = 0.1, 0.3, 0.02, 12
    still, one = np.zeros(1), np.array([0])
    reading = AffineObservation[Tick](1, lambda _: np.eye(1), sigma**2 * np.eye(1))
    before = Joined(
        Trend(("f",), Gaussian(still, level_sd**2 * np.eye(1)), still, one, still, still), reading
    )
    early = posterior_bound(before, ticks(onset))
    known = Gaussian(still, early.cov[:1, :1])
    after = Joined(Trend(("f",), known, still, one, np.array([rate_sd]), still), reading)
    late = posterior_bound(after, ticks(STEPS - onset))
    found = ramp_bound(sigma, onset, STEPS, level_sd, rate_sd)
    np.testing.assert_allclose(found, np.r_[early["f"], late["f"]], rtol=1e-9)


def test_not_knowing_the_onset_costs() -> None:
    known, unknown = (ramp_bound(0.1, 12, STEPS, 0.3, 0.02, 0.02, sd) for sd in (0.0, 10.0))
    assert (unknown[12:] > known[12:]).all() and np.array_equal(unknown[:12], known[:12])


def test_a_process_that_bends_is_refused() -> None:
    class Bent(Product):
        def transition_jacobian(self, x: Array, u: Any) -> Array:
            return np.broadcast_to(np.eye(2), (*x.shape[:-1], 2, 2))

    with pytest.raises(UrdynError, match="one for all states"):
        posterior_bound(Bent(), ticks(2))
