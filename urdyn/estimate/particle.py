"""The particle filter (the paper's eq. 9), Rao-Blackwellised [Schon2005]_.

Only the states in which the model bends are sampled; given those the others are Gaussian and each
particle carries Kalman's mean of them. Where the Jacobians do not depend on the particle, one
covariance serves all. A model that is affine throughout leaves nothing to sample: the filter is
then Kalman's. Sampled states that nothing moves (no process noise) lose their diversity at every
resampling, as in any particle filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation, Rows, measured_rows, residual_of
from urdyn.estimate.linearised import joseph, noise_of
from urdyn.estimate.mixture import log_density, mixture_innovation, moments, normalised
from urdyn.estimate.square_root import lower_root, pseudo_inverse
from urdyn.given import given_count
from urdyn.types import Array, Gaussian, Mask, frozen


@dataclass(frozen=True, eq=False)
class Particles:
    """A weighted cloud."""

    x: Array  # (K, n) sampled states; in the others the conditional means
    cov: Array  # (1 or K, n, n) conditional covariance, zero in the sampled states
    log_weight: Array  # (K,) normalised
    draws: int = 0  # drawn so far: with the filter's seed, all the state its randomness has

    def __post_init__(self) -> None:
        for name in ("x", "cov", "log_weight"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class ParticleFilter:
    """Bootstrap proposal, systematic resampling."""

    count: int = 1000
    threshold: float = 0.5  # resampled when the effective number falls below this fraction
    marginalise: bool = True  # False: sample every state, as the paper does
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", given_count(self.count, "count"))
        if not 0.0 <= self.threshold <= 1.0:
            raise InputError(f"threshold {self.threshold}: a fraction of the particles, 0 to 1")
        if not (isinstance(self.seed, Integral) and self.seed >= 0):
            raise InputError(f"seed {self.seed}: takes a whole number, 0 or more")

    def init(self, model: TwoSlice[U]) -> Particles:
        """A cloud drawn from the model's prior."""
        x = np.tile(model.prior.mean, (self.count, 1))
        x, cov = _draw(x, model.prior.cov[None], self._sampled(model), self._rng(0))
        return Particles(x, cov, np.full(self.count, -np.log(self.count)), 1)

    def step(
        self, model: TwoSlice[U], state: Particles, u: U, y: Array
    ) -> tuple[Particles, Innovation]:
        """Predict over u.dt, then learn from the finite rows of y, (m,)."""
        rng = self._rng(state.draws)
        cov = model.transition_cov(u)[None]
        if state.cov.any():
            F = model.transition_jacobian(state.x, u)
            cov = F @ state.cov @ np.swapaxes(F, -1, -2) + cov
        x, cov = _draw(model.transition(state.x, u), cov, self._sampled(model), rng)
        predicted = replace(state, x=x, cov=cov, draws=state.draws + 1)
        posterior, seen = _weigh(model, predicted, u, y)
        effective = 1.0 / np.exp(2.0 * posterior.log_weight).sum()
        if effective < self.threshold * self.count:
            posterior = _resampled(posterior, rng)
        return posterior, seen

    def belief(self, state: Particles) -> Gaussian:
        """Mean and covariance of the cloud."""
        return moments(np.exp(state.log_weight), state.x, state.cov)

    def shifted(self, state: Particles, by: Array) -> Particles:
        """The same cloud about states that have all moved by known amounts, (n,)."""
        return replace(state, x=state.x + by)

    def _sampled(self, model: TwoSlice[U]) -> Mask:
        return ~model.linear if self.marginalise else np.ones(len(model.names), dtype=bool)

    def _rng(self, draws: int) -> np.random.Generator:
        return np.random.default_rng((self.seed, draws))


def _draw(mean: Array, cov: Array, sampled: Mask, rng: np.random.Generator) -> tuple[Array, Array]:
    """Sample `sampled` of N(mean (K, n), cov (1 or K, n, n)), and condition the rest on that."""
    at = np.flatnonzero(sampled)
    if not len(at):
        return mean, cov
    if sampled.all() and len(cov) == 1:
        unit = rng.standard_normal(mean.shape)
        return mean + unit @ lower_root(cov[0]).T, np.zeros_like(cov)
    across = cov[:, :, at]
    marginal = across[:, at]
    root = np.array([lower_root(P) for P in marginal])
    drawn = root @ rng.standard_normal((len(mean), len(at), 1))
    gain = across @ pseudo_inverse(marginal)
    rest = cov - gain @ np.swapaxes(across, -1, -2)
    # Exactly zero where rounding would leave a trace.
    rest[:, at] = rest[:, :, at] = 0.0
    return mean + np.squeeze(gain @ drawn, -1), rest


def _weigh(
    model: TwoSlice[U], predicted: Particles, u: U, y: Array
) -> tuple[Particles, Innovation]:
    """Weights by likelihood, and Kalman's correction of what is not sampled."""
    rows, x = measured_rows(y), predicted.x
    whole = model.observe(x, u)
    expected, R = whole[:, rows], noise_of(model, u, whole)[rows][:, rows]
    if not predicted.cov.any():
        return _weigh_points(predicted, expected, R, y, rows)
    H = model.observe_jacobian(x, u)[..., rows, :]
    HP = H @ predicted.cov
    S = HP @ np.swapaxes(H, -1, -2) + R
    residual = residual_of(y, rows, expected)
    weight, total = normalised(predicted.log_weight + log_density(residual, S))
    gain = np.swapaxes(np.linalg.solve(S, HP), -1, -2)
    seen = moments(np.exp(predicted.log_weight), expected, S)
    moved = x + np.squeeze(gain @ residual[..., None], -1)
    cov = joseph(predicted.cov, gain, H, HP, R)
    posterior = replace(predicted, x=moved, cov=cov, log_weight=weight)
    return posterior, mixture_innovation(y, rows, seen, total)


def _weigh_points(
    predicted: Particles, expected: Array, R: Array, y: Array, rows: Rows
) -> tuple[Particles, Innovation]:
    """Weights by likelihood where every state is sampled: there is nothing to correct."""
    density = log_density(residual_of(y, rows, expected), R[None])
    weight, total = normalised(predicted.log_weight + density)
    seen = moments(np.exp(predicted.log_weight), expected, R)
    return replace(predicted, log_weight=weight), mixture_innovation(y, rows, seen, total)


def _resampled(cloud: Particles, rng: np.random.Generator) -> Particles:
    """Systematic resampling [Kitagawa1996]_: equal weights, one random number."""
    K = len(cloud.log_weight)
    ladder = (np.arange(K) + rng.random()) / K
    edges = np.cumsum(np.exp(cloud.log_weight))
    chosen = np.minimum(np.searchsorted(edges, ladder), K - 1)
    cov = cloud.cov if len(cloud.cov) == 1 else cloud.cov[chosen]
    return replace(cloud, x=cloud.x[chosen], cov=cov, log_weight=np.full(K, -np.log(K)))
