"""A bank of hypotheses, onset x jump (of a rate: onset x rate), weighed by likelihood.

Every hypothesis is Kalman's filter with one known jump. When and how far it jumped does not change
the covariance; so the whole bank shares one, runs in parallel, and costs little more than one
filter. Every `spacing` slices are a candidate onset, and the last `onsets` candidates are kept;
older ones are merged, because what began long ago is told apart by where it is now.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.dbn.jumps import Jumps
from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation, measured_rows, whitening
from urdyn.estimate.linearised import carried, joseph, linear_rows
from urdyn.estimate.mixture import log_density, moments, normalised, surprise
from urdyn.types import Array, Gaussian, frozen


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Beliefs under "nothing has jumped" (row 0) and under A onsets x D jumps (the others)."""

    means: Array  # (1 + A D, n)
    cov: Array  # (n, n) shared
    log_weight: Array  # (1 + A D,) normalised
    slices: int = 0  # passed since the start

    def __post_init__(self) -> None:
        for name in ("means", "cov", "log_weight"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def weight(self) -> Array:
        """Posterior probabilities, (1 + A D,); the first is that of no jump."""
        return np.exp(self.log_weight)


@dataclass(frozen=True, eq=False)
class Bank:
    """Exact up to the grid where the model is affine; linearised at the mixture's mean elsewhere.

    Two jumps are outside its hypotheses: after the first, only process noise follows a second.
    """

    jumps: Jumps  # D alternatives
    onsets: int = 64  # A candidates kept
    spacing: int = 1  # slices between candidates
    hazard: float = 1e-2  # prior probability of a jump, per slice

    def init(self, model: TwoSlice[U]) -> Hypotheses:
        """The model's prior under every hypothesis; nothing has jumped."""
        count = 1 + self.onsets * len(self.jumps.step)
        log_weight = np.full(count, -np.inf)
        log_weight[0] = 0.0
        return Hypotheses(np.tile(model.prior.mean, (count, 1)), model.prior.cov, log_weight)

    def step(
        self, model: TwoSlice[U], state: Hypotheses, u: U, y: Array
    ) -> tuple[Hypotheses, Innovation]:
        """Predict over u.dt, branch, then weigh by the finite rows of y, (m,)."""
        if state.slices % self.spacing == 0:
            state = self._branch(state)
        F = model.transition_jacobian(self.belief(state).mean, u)
        means = model.transition(state.means, u)
        cov = carried(F, state.cov) + model.transition_cov(u)
        moved = Hypotheses(means, cov, state.log_weight, state.slices + 1)
        return _weigh(model, moved, u, y)

    def belief(self, state: Hypotheses) -> Gaussian:
        """Moments of the mixture."""
        return moments(state.weight, state.means, state.cov)

    def _branch(self, state: Hypotheses) -> Hypotheses:
        """Jumps from "nothing has jumped" up to now, in the place of the oldest onset."""
        D = len(self.jumps.step)
        means, log_weight = state.means.copy(), state.log_weight.copy()
        at = state.slices // self.spacing
        oldest, next_oldest = (1 + D * (i % self.onsets) for i in (at, at + 1))
        old, kept = slice(oldest, oldest + D), slice(next_oldest, next_oldest + D)
        if self.onsets > 1:
            _merge(means, log_weight, old, kept)
        prior = 1.0 - (1.0 - self.hazard) ** self.spacing
        means[old] = means[0] + self.jumps.step
        log_weight[old] = log_weight[0] + np.log(prior * self.jumps.weight)
        log_weight[0] += np.log1p(-prior)
        return replace(state, means=means, log_weight=normalised(log_weight)[0])


def _merge(means: Array, log_weight: Array, old: slice, kept: slice) -> None:
    """Hand the oldest onsets' weight to the next oldest, jump by jump, with a mean between."""
    total = np.logaddexp(log_weight[old], log_weight[kept])
    share = np.exp(log_weight[old] - np.where(np.isinf(total), 0.0, total))[:, None]
    means[kept] += share * (means[old] - means[kept])
    log_weight[kept] = total


def _weigh(
    model: TwoSlice[U], predicted: Hypotheses, u: U, y: Array
) -> tuple[Hypotheses, Innovation]:
    """Likelihoods, weights, and one Kalman gain for all."""
    rows = measured_rows(y)
    prior = moments(predicted.weight, predicted.means, predicted.cov)
    expected = model.observe(predicted.means, u)[:, rows]
    H, R = linear_rows(model, prior.mean, u, rows)
    HP = H @ predicted.cov
    S = HP @ H.T + R
    W, _ = whitening(S)
    K = HP.T @ (W.T @ W)
    residual = y[rows] - expected
    log_weight, total = normalised(predicted.log_weight + log_density(residual, S))
    seen = moments(predicted.weight, expected, S)
    posterior = replace(
        predicted,
        means=predicted.means + residual @ K.T,
        cov=joseph(predicted.cov, K, H, HP, R),
        log_weight=log_weight,
    )
    return posterior, surprise(y, rows, seen, total)
