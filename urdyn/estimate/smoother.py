"""Beliefs about the past, given later observations.

Later observations act on a slice as readings of unit noise, z = W (x - x̂) + e, about the filter's
belief. Carried back over the slices, they update its belief in each [Fraser1969]_. With a prime for
the next slice, a minus for the prediction and P = L Lᵀ,

    W⁺ = [W'; V H],    z⁺ = [z'; V (y - h(x⁻) - H (x̂' - x⁻))],    V R Vᵀ = 1
    W = C⁻¹ W⁺ F,      z = C⁻¹ (z⁺ + W⁺ (x̂' - x⁻)),               C Cᵀ = 1 + W⁺ Q W⁺ᵀ
    P_s = L (1 + Lᵀ Wᵀ W L)⁻¹ Lᵀ,    x_s = x̂ + P_s Wᵀ z

Neither F, Q nor a belief's covariance is inverted: for states that decay with hardly any process
noise, this would magnify rounding in each slice. Transitions are linearised at the filter's mean.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.smoothed import Smoothed
from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation, measured_rows, whitening
from urdyn.estimate.linearised import (
    Expected,
    linear_rows,
    propagated,
    updated,
    without_negatives,
)
from urdyn.estimate.protocol import paired
from urdyn.estimate.square_root import JITTER, lower_root
from urdyn.given import given_count
from urdyn.types import Array, Gaussian


@dataclass(frozen=True, eq=False)
class Passed:
    """One slice as the filter processed it."""

    moves: Array  # (n + 1, n + 1) [[F, x̂ - x⁻], [0, 1]], from the slice before
    Q: Array  # (n, n)
    filtered: Gaussian
    read: Array  # (r, n + 1) [W z] of its own observations


@dataclass(frozen=True, eq=False)
class Recent:
    """The oldest belief kept, and the slices since."""

    before: Gaussian  # filtered, of the slice before the first in `passed`
    passed: tuple[Passed, ...]

    @property
    def last(self) -> Gaussian:
        """The filtered belief of the newest slice."""
        return self.passed[-1].filtered if self.passed else self.before


@dataclass(frozen=True)
class FixedLag:
    """A filter whose belief is about the slice `lag` slices ago, given all observations since."""

    lag: int = 10

    def __post_init__(self) -> None:
        object.__setattr__(self, "lag", given_count(self.lag, "lag", 0))

    def init(self, model: TwoSlice[U]) -> Recent:
        """The model's prior."""
        return Recent(model.prior, ())

    def step(self, model: TwoSlice[U], state: Recent, u: U, y: Array) -> tuple[Recent, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,); drop old slices."""
        here, innovation = _forward(model, state.last, u, y)
        passed = (*state.passed, here)
        if len(passed) <= self.lag:
            return Recent(state.before, passed), innovation
        return Recent(passed[0].filtered, passed[1:]), innovation

    def belief(self, state: Recent) -> Gaussian:
        """The belief about the slice `lag` ago; about the prior's until so many have passed."""
        later = _nothing(state.before)
        for slice_ in reversed(state.passed):
            later = _undisturbed(slice_, later) @ slice_.moves
        return _beside(state.before, later)


def smooth(
    model: TwoSlice[U], inputs: Iterable[U], observations: Iterable[Array]
) -> tuple[Smoothed, float]:
    """Beliefs about all slices given all observations, (N, m), and the log of their likelihood.

    Raises:
        InputError: inputs and observations do not fit each other or the model.
    """
    state, log_likelihood, passed = model.prior, 0.0, []
    for u, y in paired(model, inputs, observations):
        here, innovation = _forward(model, state, u, y)
        passed.append(here)
        state = here.filtered
        log_likelihood += innovation.log_likelihood
    return _backward(Recent(model.prior, tuple(passed))), log_likelihood


def _forward(model: TwoSlice[U], state: Gaussian, u: U, y: Array) -> tuple[Passed, Innovation]:
    F, Q = model.transition_jacobian(state.mean, u), model.transition_cov(u)
    predicted = Gaussian(model.transition(state.mean, u), propagated(F, state.cov) + Q)
    rows, n = measured_rows(y), len(F)
    seen, H, R = linear_rows(model, predicted.mean, u, rows)
    cross = H @ predicted.cov
    own = cross @ H.T
    filtered, innovation = updated(predicted, Expected(seen, cross, own, R), y, rows)
    moves = np.eye(n + 1)
    moves[:n, :n], moves[:n, n] = F, filtered.mean - predicted.mean
    left = y[rows] - seen - H @ moves[:n, n]
    # R may be singular where S is not: no reading has less noise than S has rounding error.
    V, _ = whitening(R + JITTER * np.diag((own + R).diagonal()))
    return Passed(moves, Q, filtered, V @ np.column_stack([H, left])), innovation


def _backward(state: Recent) -> Smoothed:
    """Smooth from the newest slice to the oldest; index 0 is the belief before the first."""
    later, n = _nothing(state.before), len(state.before.mean)
    means, covs, crosses = [state.last.mean], [state.last.cov], []
    filtered = [state.before, *(p.filtered for p in state.passed[:-1])]
    for here, slice_ in zip(reversed(filtered), reversed(state.passed), strict=False):
        told = _undisturbed(slice_, later)
        later = told @ slice_.moves
        belief = _beside(here, later)
        # Dependence of the next slice on this one, given all later data: (1 + Q W⁺ᵀ W⁺)⁻¹ F.
        A = slice_.moves[:n, :n] - slice_.Q @ told[:, :n].T @ later[:, :n]
        means.append(belief.mean)
        covs.append(belief.cov)
        crosses.append(A @ belief.cov)
    return Smoothed(
        np.array(means[::-1]), np.array(covs[::-1]), np.reshape(crosses[::-1], (-1, n, n))
    )


def _nothing(belief: Gaussian) -> Array:
    """Observations after the newest slice: none, (0, n + 1)."""
    return np.zeros((0, len(belief.mean) + 1))


def _undisturbed(here: Passed, later: Array) -> Array:
    """Readings from a slice on, [W z], (k, n + 1), about where it would be without its Q.

    At most n readings are kept: they contain all the information.
    """
    n = len(here.Q)
    told = np.concatenate([later, here.read])
    if len(told) > n:
        told = np.asarray(np.linalg.qr(told, mode="r"))[:n]
    W = told[:, :n]
    noise = np.eye(len(W)) + without_negatives(W @ here.Q @ W.T)
    return np.asarray(np.linalg.solve(lower_root(noise), told))


def _beside(belief: Gaussian, later: Array) -> Gaussian:
    """The belief given readings [W z], (k, n + 1), about its mean."""
    if not len(later):
        return belief
    n, L = len(belief.mean), lower_root(belief.cov)
    white = np.eye(n + 1)
    white[:n, :n] = L
    rows = np.concatenate([later @ white, np.eye(n, n + 1)])
    R = np.asarray(np.linalg.qr(rows, mode="r"))
    root = L @ np.linalg.inv(R[:n, :n])
    return Gaussian(belief.mean + root @ R[:n, n], root @ root.T)
