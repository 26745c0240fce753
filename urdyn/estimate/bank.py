"""A bank of hypotheses, onset x jump (of a rate: onset x rate), weighted by likelihood.

Every hypothesis is Kalman's filter with one jump, whose size is Gaussian around its own step. How
far it jumped does not change the covariance; so hypotheses share covariances, one per onset and
spread, run in parallel, and cost little more than one filter. The spread fills the gaps between a
grid's points: sizes are marginalised, not enumerated, and a ramp may go on for as long as it likes.
Every `spacing` slices are a candidate onset, and the last `onsets` candidates are kept; older ones
are merged, because jumps of long ago differ by where they are now.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.dbn.jumps import Jumps
from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation, measured_rows, residual_of
from urdyn.estimate.linearised import joseph, noise_of
from urdyn.estimate.mixture import log_density, mixture_innovation, moments, normalised
from urdyn.given import given_count
from urdyn.types import Array, Gaussian, freeze


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Beliefs under "nothing has jumped" (row 0) and under A onsets x D jumps (the others)."""

    means: Array  # (1 + A D, n)
    cov: Array  # (1 + A K, n, n) shared by the jumps of an onset that spread alike
    log_weight: Array  # (1 + A D,) normalised
    slices: int = 0  # passed since the start

    def __post_init__(self) -> None:
        freeze(self, "means", "cov", "log_weight")

    @property
    def weight(self) -> Array:
        """Posterior probabilities, (1 + A D,); the first is that of no jump."""
        return np.exp(self.log_weight)

    @property
    def gaussian(self) -> Gaussian:
        """Moments of the mixture."""
        return moments(self.weight, self.means, self.average(self.cov))

    def average(self, values: Array) -> Array:
        """Posterior mean of values, one per covariance, (1 + A K, ...)."""
        weight = self.weight
        shared = weight[1:].reshape(len(values) - 1, -1).sum(axis=1)
        return np.tensordot(np.r_[weight[0], shared], values, axes=1)

    def each(self, values: Array) -> Array:
        """Such values, each repeated for the hypotheses that share it: (1 + A D, ...)."""
        jumps = (len(self.means) - 1) // (len(values) - 1)
        return np.concatenate([values[:1], np.repeat(values[1:], jumps, axis=0)])


@dataclass(frozen=True, eq=False)
class Bank:
    """Exact up to merging where the model is affine; elsewhere linearised at the mixture's mean.

    Two jumps are outside its hypotheses: after the first, only process noise follows a second.
    """

    jumps: Jumps  # D alternatives of K spreads
    onsets: int = 64  # A candidates kept, two or more: the oldest is merged into the next oldest
    spacing: int = 1  # slices between candidates
    hazard: float = 1e-2  # prior probability of a jump, per slice

    def __post_init__(self) -> None:
        for name, least in (("onsets", 2), ("spacing", 1)):
            object.__setattr__(self, name, given_count(getattr(self, name), name, least))
        if not 0.0 < self.hazard < 1.0:
            raise InputError(f"hazard {self.hazard}: a probability, above 0 and below 1")

    def init(self, model: TwoSlice[U]) -> Hypotheses:
        """The model's prior under every hypothesis; nothing has jumped."""
        if self.jumps.step.shape[1] != len(model.names):
            raise InputError(
                f"jumps are of {self.jumps.step.shape[1]} states and the model has "
                f"{len(model.names)}: {', '.join(model.names)}"
            )
        count = 1 + self.onsets * len(self.jumps.step)
        log_weight = np.full(count, -np.inf)
        log_weight[0] = 0.0
        cov = np.tile(model.prior.cov, (1 + self.onsets * len(self.jumps.spread), 1, 1))
        return Hypotheses(np.tile(model.prior.mean, (count, 1)), cov, log_weight)

    def step(
        self, model: TwoSlice[U], state: Hypotheses, u: U, y: Array
    ) -> tuple[Hypotheses, Innovation]:
        """Predict over u.dt, branch, then weigh by the finite rows of y, (m,)."""
        if state.slices % self.spacing == 0:
            state = self._branch(state)
        F = model.transition_jacobian(state.gaussian.mean, u)
        means = model.transition(state.means, u)
        cov = F @ state.cov @ F.T + model.transition_cov(u)
        moved = Hypotheses(means, cov, state.log_weight, state.slices + 1)
        return _weigh(model, moved, u, y)

    def belief(self, state: Hypotheses) -> Gaussian:
        """Moments of the mixture."""
        return state.gaussian

    def shifted(self, state: Hypotheses, by: Array) -> Hypotheses:
        """The same hypotheses about states that have all moved by known amounts, (n,)."""
        return replace(state, means=state.means + by)

    def _branch(self, state: Hypotheses) -> Hypotheses:
        """Jumps from "nothing has jumped" now, in place of the oldest onset."""
        (D, n), K = self.jumps.step.shape, len(self.jumps.spread)
        at = state.slices // self.spacing
        oldest, next_oldest = (i % self.onsets for i in (at, at + 1))
        state = _merged(state, oldest, next_oldest, self.jumps)
        means, cov, log_weight = (x.copy() for x in (state.means, state.cov, state.log_weight))
        rows = _rows(oldest, D)
        prior = 1.0 - (1.0 - self.hazard) ** self.spacing
        means[rows] = means[0] + self.jumps.step
        cov[_rows(oldest, K)] = cov[0] + self.jumps.spread[:, None] ** 2 * np.eye(n)
        log_weight[rows] = log_weight[0] + np.log(prior * self.jumps.weight)
        log_weight[0] += np.log1p(-prior)
        return replace(state, means=means, cov=cov, log_weight=normalised(log_weight)[0])


def _rows(onset: int, each: int) -> slice:
    return slice(1 + each * onset, 1 + each * (onset + 1))


def _merged(state: Hypotheses, oldest: int, next_oldest: int, jumps: Jumps) -> Hypotheses:
    """The oldest onset merged into the next oldest, jump by jump, by weights and moments."""
    D, K = len(jumps.step), len(jumps.spread)
    old, kept = _rows(oldest, D), _rows(next_oldest, D)
    log_weight, means, cov = (x.copy() for x in (state.log_weight, state.means, state.cov))
    total = np.logaddexp(log_weight[old], log_weight[kept])
    share = np.exp(log_weight[old] - np.where(np.isinf(total), 0.0, total))
    apart = means[old] - means[kept]
    if np.isfinite(total).any():
        by_spread = total.reshape(K, -1)
        weight = np.exp(by_spread - by_spread.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        handed, left = weight * share.reshape(K, -1), 1.0 - share.reshape(K, -1)
        away = apart.reshape(K, D // K, -1)
        into = cov[_rows(next_oldest, K)]
        into += handed.sum(axis=1)[:, None, None] * (cov[_rows(oldest, K)] - into)
        into += ((handed * left)[..., None] * away).mT @ away
    means[kept] += share[:, None] * apart
    log_weight[kept] = total
    return replace(state, means=means, cov=cov, log_weight=log_weight)


def _weigh(
    model: TwoSlice[U], predicted: Hypotheses, u: U, y: Array
) -> tuple[Hypotheses, Innovation]:
    """Likelihoods, weights, and Kalman's update with one gain per covariance."""
    rows = measured_rows(y)
    whole = model.observe(predicted.means, u)
    expected, R = whole[:, rows], noise_of(model, u, whole)[rows][:, rows]
    H = model.observe_jacobian(predicted.gaussian.mean, u)[rows]
    HP = H @ predicted.cov
    S = HP @ H.T + R
    residual = residual_of(y, rows, expected)
    density = log_density(residual, predicted.each(S))
    K = np.swapaxes(np.linalg.solve(S, HP), -1, -2)
    log_weight, total = normalised(predicted.log_weight + density)
    seen = moments(predicted.weight, expected, predicted.average(S))
    learnt = (predicted.each(K) @ residual[..., None])[..., 0]
    posterior = replace(
        predicted,
        means=predicted.means + learnt,
        cov=joseph(predicted.cov, K, H, HP, R),
        log_weight=log_weight,
    )
    return posterior, mixture_innovation(y, rows, seen, total)
