"""A block of its own beside a filter: the joint Kalman filter, without its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from urdyn.dbn.measurement import LinearMeasurement, Standing
from urdyn.estimate import EKF, UKF, InformationFilter, Variational
from urdyn.tracking.streams.conditional_filter import (
    ConditionalBelief,
    LinearisedObservation,
    measurement,
    updated,
    updated_noise,
)
from urdyn.types import Array, Gaussian

X, S = 4, 3  # states of the filter, and of the block
SHARED = np.array([1, 2])


@dataclass
class Both:
    """The joint filter, the dense way: mean and covariance of (x, s)."""

    mean: Array
    cov: Array

    def update(self, H, R, y):
        G = H @ self.cov @ H.T + R
        K = np.linalg.solve(G, H @ self.cov).T
        self.mean = self.mean + K @ (y - H @ self.mean)
        self.cov = self.cov - K @ H @ self.cov


def spd(rng, n):
    A = rng.standard_normal((n, n))
    return A @ A.T + 0.1 * np.eye(n)


def begin(rng):
    x = Gaussian(rng.standard_normal(X), spd(rng, X))
    point, cov = rng.standard_normal(S), spd(rng, S)
    few = x.cov[np.ix_(SHARED, SHARED)]
    conditional = ConditionalBelief(np.zeros((S, len(SHARED))), cov, x.mean[SHARED], few)
    whole = np.zeros((X + S, X + S))
    whole[:X, :X], whole[X:, X:] = x.cov, cov
    return x, point, conditional, Both(np.r_[x.mean, point], whole)


def by_currents(x, H, R, y):
    K = np.linalg.solve(H @ x.cov @ H.T + R, H @ x.cov).T
    return Gaussian(x.mean + K @ (y - H @ x.mean), x.cov - K @ H @ x.cov)


def z_of(x):
    return Gaussian(x.mean[SHARED], x.cov[np.ix_(SHARED, SHARED)])


@pytest.mark.parametrize("filter_", [EKF(), UKF(), InformationFilter(), Variational()])
def test_two_blocks_that_share_states_are_one_kalman_filter(filter_):
    rng = np.random.default_rng(1)
    x, point, conditional, both = begin(rng)
    standing = Standing(tuple("abcd"), x)
    state = filter_.init(standing)
    for k in range(12):
        y = rng.standard_normal(2)
        if k % 3 == 0:  # what only the filter sees
            H, R = rng.standard_normal((2, X)), spd(rng, 2)
            every = LinearMeasurement(np.arange(X), H, R, np.zeros(X))
            state, _ = filter_.step(standing, state, every, y)
            both.update(np.hstack([H, np.zeros((2, S))]), R, y)
            continue
        Hs, Hz, R = rng.standard_normal((2, S)), rng.standard_normal((2, 2)), spd(rng, 2)
        z = z_of(filter_.belief(state))
        step, conditional = conditional.settled(z)
        point = point + step
        look = LinearisedObservation(y - Hs @ point - Hz @ z.mean, Hs, Hz, R)
        shared = measurement(conditional, look, np.zeros(2))
        step, conditional = updated(conditional, look)
        point = point + step
        state, _ = filter_.step(
            standing, state, LinearMeasurement(SHARED, shared.H, shared.R, shared.jump), shared.y
        )
        step, conditional = conditional.settled(z_of(filter_.belief(state)))
        point = point + step
        H = np.zeros((2, X + S))
        H[:, SHARED], H[:, X:] = Hz, Hs
        both.update(H, R, y)
    step, conditional = conditional.settled(z_of(filter_.belief(state)))
    belief = filter_.belief(state)
    np.testing.assert_allclose(belief.mean, both.mean[:X], rtol=0, atol=1e-8)
    np.testing.assert_allclose(belief.cov, both.cov[:X, :X], rtol=0, atol=1e-8)
    np.testing.assert_allclose(point + step, both.mean[X:], rtol=0, atol=1e-8)
    np.testing.assert_allclose(conditional.whole, both.cov[X:, X:], rtol=0, atol=1e-8)


def test_what_is_shared_may_stray_and_jump():
    """z' = z + w: the joint belief in (z', s), where the filter has nothing but z."""
    rng = np.random.default_rng(2)
    P, Q = spd(rng, 5), spd(rng, 2)  # of (z, s)
    L = np.linalg.solve(P[:2, :2], P[:2, 2:]).T
    before = ConditionalBelief(L, P[2:, 2:] - L @ P[:2, 2:], np.zeros(2), P[:2, :2])
    after = before.after_drift(Q)
    moved = P.copy()
    moved[:2, :2] += Q
    L = np.linalg.solve(moved[:2, :2], moved[:2, 2:]).T
    np.testing.assert_allclose(after.L, L, atol=1e-12)
    np.testing.assert_allclose(after.cov, moved[2:, 2:] - L @ moved[:2, 2:], atol=1e-12)
    np.testing.assert_allclose(after.whole, before.whole, atol=1e-12)


def test_with_nothing_shared_it_is_an_ordinary_filter():
    rng = np.random.default_rng(3)
    cov, H, R, e = spd(rng, S), rng.standard_normal((2, S)), spd(rng, 2), rng.standard_normal(2)
    nothing = np.zeros((0, 0))
    conditional = ConditionalBelief(np.zeros((S, 0)), cov, np.zeros(0), nothing)
    step, after = updated(conditional, LinearisedObservation(e, H, np.zeros((2, 0)), R))
    both = Both(np.zeros(S), cov)
    both.update(H, R, e)
    np.testing.assert_allclose(step, both.mean, atol=1e-12)
    np.testing.assert_allclose(after.whole, both.cov, atol=1e-12)


def test_noise_is_learnt_while_states_are():
    """Three thousand rows: the sd of a variance is sqrt(2 / n) of it, 4 % of 1.3."""
    rng, true = np.random.default_rng(4), 0.3
    squares, s = np.array([1.0]), np.array([0.5, -0.2])
    conditional = ConditionalBelief(np.zeros((2, 0)), np.eye(2), np.zeros(0), np.zeros((0, 0)))
    point = np.zeros(2)
    for k in range(1000):
        H = rng.standard_normal((3, 2))
        e = H @ (s - point) + true * rng.standard_normal(3)
        look = LinearisedObservation(e, H, np.zeros((3, 0)), np.diag(np.repeat(squares, 3)))
        squares = updated_noise(squares, conditional, look, 1.0 / min(k + 2.0, 300.0))
        step, conditional = updated(conditional, look)
        point = point + step
    # averaged over the last 300 triples of them: a standard deviation of 1 / sqrt(2 * 900).
    assert abs(np.sqrt(squares[0]) / true - 1.0) < 4.0 / np.sqrt(1800.0)
