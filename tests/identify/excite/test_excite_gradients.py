"""Every slope that the search follows is a derivative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify.excite.basis import basis
from urdyn.identify.excite.climb import begin, climb_from, step, with_slack
from urdyn.identify.excite.columns import columns
from urdyn.identify.excite.criterion import CRITERIA, judge
from urdyn.identify.excite.proof import Safe
from urdyn.identify.excite.question import question
from urdyn.model.collision import collider
from urdyn.simulate.fourier import Series, draw, series_within
from urdyn.simulate.limits import comfortable

H = 1e-5  # of differences from both sides: they err by the third derivative times 1e-10


@pytest.fixture(scope="module")
def climb(ur10e):
    safe = Safe(comfortable(ur10e), collider(ur10e), 0.02)
    torque = 0.2 * safe.limits.torque
    return with_slack(climb_from(question(ur10e), safe, "D", 1e3, 4, 6.0), 0.02, torque)


@pytest.fixture(scope="module")
def series(ur10e):
    return series_within(ur10e, draw(6, 6.0, np.random.default_rng(5), 4))


def test_a_vector_is_its_series(climb, series):
    x = climb.coarse.vector(series)
    again = climb.coarse.series(x)
    t = np.linspace(0.0, 6.0, 50)
    np.testing.assert_allclose(again.at(t), series.at(t), rtol=0, atol=1e-12)
    np.testing.assert_allclose(climb.coarse.motion(x), series.at(climb.coarse.times), atol=1e-12)


def test_every_vector_is_at_rest_at_both_ends():
    made = basis(3, 6, 5.0, 40)
    q, v, a = made.series(np.random.default_rng(0).standard_normal(made.size)).at(
        np.array([0.0, 5.0])
    )
    assert np.abs(v).max() < 1e-12 * 2.0 * np.pi / 5.0 * 100
    assert np.abs(a).max() < 1e-11 * 100
    np.testing.assert_allclose(q[0], q[1], atol=1e-12)


@pytest.mark.parametrize("name", CRITERIA)
def test_a_criterions_slope_is_its_derivative(climb, series, name):
    asked = climb.question
    M = asked.information(columns(asked.point, *series.at(climb.coarse.times)), 1e3)
    _, S = judge(name, M, asked.asked)
    E = np.random.default_rng(1).standard_normal(M.shape)
    L, h = np.linalg.cholesky(M), 1e-4
    dM = L @ (E + E.T) @ L.T / np.linalg.norm(E + E.T)
    up, down = (judge(name, M + sign * h * dM, asked.asked)[0] for sign in (1.0, -1.0))
    # Of second order in h, and rounding of 1e-16 times the condition of M, over h.
    np.testing.assert_allclose((up - down) / (2.0 * h), (S * dM).sum(), rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_lagrangians_gradient_is_its_derivative(climb, series, seed):
    # Far out and low, so that bounds are broken.
    low = replace(series.scaled(1.6), middle=series.middle + np.array([0, 0.8, 0.8, 0, 0, 0]))
    x = climb.coarse.vector(low)
    mu = tuple(0.1 + m for m in begin(climb, x).mu)
    broken = [b.max() > 0.0 for b in climb.bounds(x)]
    assert all(broken)
    d = np.random.default_rng(seed).standard_normal(x.shape)
    up, down = (climb.lagrangian(x + sign * H * d, mu, 7.0)[0] for sign in (1.0, -1.0))
    slope = climb.lagrangian(x, mu, 7.0)[1] @ d
    # The regressor's own differences are one-sided, 1e-6 wide.
    np.testing.assert_allclose((up - down) / (2.0 * H), slope, rtol=1e-4, atol=1e-3)


def test_a_round_raises_the_criterion_or_mends_a_bound(climb, series):
    x = climb.coarse.vector(series)
    state = begin(climb, x)
    after = step(climb, state)
    rho = state.rho
    assert climb.lagrangian(after.x, state.mu, rho)[0] < climb.lagrangian(x, state.mu, rho)[0]
    assert climb.value(climb.coarse.series(after.x)) > climb.value(series)


def test_information_does_not_depend_on_how_finely_it_is_summed(climb, series):
    asked = climb.question
    values = []
    for rows in (64, 512):
        t = np.arange(rows) * (series.period / rows)
        M = asked.information(columns(asked.point, *series.at(t)), 1e3)
        values.append(judge("D", M, asked.asked)[0])
    assert abs(values[0] - values[1]) < 0.01 * abs(values[1])


def test_a_series_scaled_to_nothing_tells_only_of_gravity(climb, series):
    asked = climb.question
    still = Series(series.middle, 0.0 * series.sine, 0.0 * series.cosine, series.period)
    at_rest, moving = (climb.value(one) for one in (still, series))
    assert moving > at_rest >= judge("D", asked.known, asked.asked)[0]
