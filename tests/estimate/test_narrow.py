"""Sigma points of few arguments: against a Gaussian's own moments, and against points of all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from urdyn.dbn import Joined, RandomWalk, Tick
from urdyn.dbn.arguments import Arguments
from urdyn.estimate import UKF
from urdyn.estimate.square_root import SquareRoot
from urdyn.estimate.ukf import narrow, wide
from urdyn.types import Array, Gaussian

N, U = 9, Tick()
SD = 0.1  # of the logarithm, and of a sum of states


@dataclass(frozen=True, eq=False)
class Products:
    """y_j = exp(x_j) times a sum of all states that is the row's own."""

    sums: Array  # (2, N)

    linear = np.zeros(N, dtype=bool)

    def observe(self, x: Array, u: Tick) -> Array:
        return np.exp(x[..., :2]) * (x @ self.sums.T)

    def observe_jacobian(self, x: Array, u: Tick) -> Array:
        H = np.exp(x[:2])[:, None] * self.sums
        H[[0, 1], [0, 1]] += self.observe(x, u)
        return H

    def observe_cov(self, u: Tick) -> Array:
        return 0.01 * np.eye(2)

    def arguments(self, u: Tick) -> Arguments:
        return Arguments(self.sums[:, None], np.array([[0], [1]]), N)

    def through(self, z: Array, u: Tick) -> Array:
        return np.exp(z[..., 1]) * z[..., 0]


@pytest.fixture
def products() -> Products:
    return Products(np.random.default_rng(1).standard_normal((2, N)))


@pytest.fixture
def belief(products: Products) -> Gaussian:
    rng = np.random.default_rng(2)
    root = rng.standard_normal((N, N))
    cov = root @ root.T
    cov *= SD**2 / max(cov.diagonal().max(), *np.diag(products.sums @ cov @ products.sums.T))
    return Gaussian(rng.standard_normal(N), cov)


def model_of(products: Products, belief: Gaussian) -> Joined[Tick]:
    return Joined(RandomWalk(tuple("abcdefghi"), belief, np.zeros(N)), products)


def test_moments_are_the_gaussian_s(products: Products, belief: Gaussian) -> None:
    """E exp(a) b and what it is correlated with, in closed form.

    Points are short of what is of fourth order; of slopes, of the second where a curve mixes axes.
    """
    model, S = model_of(products, belief), products.sums
    points = UKF()._points(2)
    found = narrow(products, products.arguments(U), points, belief, U)
    by_a, b = belief.cov[:2], S @ belief.mean
    grown = np.exp(belief.mean[:2] + 0.5 * by_a[:, :2].diagonal())
    mean = grown * (b + np.diag(by_a @ S.T))
    cross = mean[:, None] * by_a + grown[:, None] * (S @ belief.cov)
    scale = np.abs(grown) * (1.0 + np.abs(b))
    assert (np.abs(found.y - mean) < SD**4 * scale).all()
    assert (np.abs(found.cross - cross) < 0.1 * SD**4 * scale[:, None]).all()
    by_all = wide(model, UKF()._points(N), SquareRoot.of(belief.mean, belief.cov), U)
    assert (np.abs(found.y - by_all.y) < SD**4 * scale).all()
    assert (np.abs(found.cross - by_all.cross) < 0.1 * SD**4 * scale[:, None]).all()


def test_what_nothing_is_known_to_move_has_its_slope(products: Products) -> None:
    """Arguments that follow from one another, or never move, have points as well."""
    cov = np.zeros((N, N))
    cov[2, 2] = SD**2
    belief = Gaussian(np.linspace(-0.5, 0.5, N), cov)
    found = narrow(products, products.arguments(U), UKF()._points(2), belief, U)
    H = products.observe_jacobian(belief.mean, U)
    np.testing.assert_allclose(found.y, products.observe(belief.mean, U), rtol=1e-6)
    np.testing.assert_allclose(found.cross, H @ cov, rtol=1e-6, atol=1e-12)


def test_a_step_learns_as_one_with_points_of_all_states(
    products: Products, belief: Gaussian
) -> None:
    class Anyhow(Products):
        arguments = None  # type: ignore[assignment]

    y, ends = np.array([0.4, -0.3]), []
    for observation in (products, Anyhow(products.sums)):
        model = model_of(observation, belief)
        state, surprise = UKF().step(model, UKF().init(model), U, y)
        ends.append((state, surprise.nis))
    np.testing.assert_allclose(ends[0][0].mean, ends[1][0].mean, rtol=0, atol=SD**2 * SD)
    np.testing.assert_allclose(ends[0][0].sd, ends[1][0].sd, rtol=SD**2)
    assert ends[0][1] == pytest.approx(ends[1][1], rel=SD)
