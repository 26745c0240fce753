"""Beliefs about the past, in the light of what came after it.

    G = P Fᵀ (P⁻)⁻¹,   x_s = x + G (x_s' - x'⁻),   P_s = (1 - G F) P (1 - G F)ᵀ + G (Q + P_s') Gᵀ

backwards over the slices [Rauch1965]_; the prime is the next slice, the minus its prediction, and
the covariance is written as a sum of squares. Transitions are linearised where the filter stood.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from urdyn.dbn.smoothed import Smoothed
from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.linearised import correct, propagated, without_negatives
from urdyn.estimate.protocol import paired
from urdyn.estimate.square_root import inverse, pseudo_inverse
from urdyn.given import given_count
from urdyn.types import Array, Gaussian, frozen


@dataclass(frozen=True, eq=False)
class Passed:
    """One slice as the filter went through it."""

    F: Array  # (n, n) from the slice before
    Q: Array  # (n, n)
    predicted: Gaussian
    filtered: Gaussian


@dataclass(frozen=True, eq=False)
class Recent:
    """The belief that all still rests on, and the slices since."""

    before: Gaussian  # filtered, of the slice before the first in `passed`
    passed: tuple[Passed, ...]

    @property
    def last(self) -> Gaussian:
        """The filtered belief of the newest slice."""
        return self.passed[-1].filtered if self.passed else self.before


@dataclass(frozen=True)
class FixedLag:
    """A filter whose belief is about the slice `lag` slices ago, given all since."""

    lag: int = 10

    def __post_init__(self) -> None:
        object.__setattr__(self, "lag", given_count(self.lag, "lag", 0))

    def init(self, model: TwoSlice[U]) -> Recent:
        """The model's prior."""
        return Recent(model.prior, ())

    def step(self, model: TwoSlice[U], state: Recent, u: U, y: Array) -> tuple[Recent, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,); forget what is older."""
        here, innovation = _forward(model, state.last, u, y)
        passed = (*state.passed, here)
        if len(passed) <= self.lag:
            return Recent(state.before, passed), innovation
        return Recent(passed[0].filtered, passed[1:]), innovation

    def belief(self, state: Recent) -> Gaussian:
        """Of the slice `lag` ago; of the prior's until so many have passed."""
        history = _backward(state)
        return Gaussian(history.mean[0], history.cov[0])


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
    F = frozen(model.transition_jacobian(state.mean, u))
    Q = frozen(model.transition_cov(u))
    predicted = Gaussian(model.transition(state.mean, u), propagated(F, state.cov) + Q)
    filtered, innovation = correct(model, predicted, u, y)
    return Passed(F, Q, predicted, filtered), innovation


def _backward(state: Recent) -> Smoothed:
    """From the newest slice to the oldest; the belief before the first comes out at index 0."""
    later = state.last
    means, covs, crosses = [later.mean], [later.cov], []
    filtered = [state.before, *(p.filtered for p in state.passed[:-1])]
    for here, slice_ in zip(reversed(filtered), reversed(state.passed), strict=False):
        later, cross = _one_back(here, slice_, later)
        means.append(later.mean)
        covs.append(later.cov)
        crosses.append(cross)
    n = len(later.mean)
    return Smoothed(
        np.array(means[::-1]), np.array(covs[::-1]), np.reshape(crosses[::-1], (-1, n, n))
    )


def _one_back(here: Gaussian, next_: Passed, later: Gaussian) -> tuple[Gaussian, Array]:
    """Smoothed belief of a slice, and the covariance of the next with it, (n, n)."""
    G = here.cov @ next_.F.T @ _inverse(next_.predicted.cov)
    mean = here.mean + G @ (later.mean - next_.predicted.mean)
    kept = np.eye(len(mean)) - G @ next_.F
    cov = kept @ here.cov @ kept.T + G @ (next_.Q + later.cov) @ G.T
    return Gaussian(mean, without_negatives(0.5 * (cov + cov.T))), later.cov @ G.T


def _inverse(cov: Array) -> Array:
    """Of a covariance; nothing is to be learnt in the directions that have no variance."""
    try:
        return inverse(cov)
    except np.linalg.LinAlgError:
        return pseudo_inverse(cov)
