"""The particle filter (the paper's eq. 9), Rao-Blackwellised [Schon2005]_.

Where states are marginalised, only those in which the model is not linear are sampled; given those
the others are Gaussian and each particle carries Kalman's mean of them. A model that is affine
throughout leaves nothing to sample: the filter is then Kalman's, and one covariance serves all. In
any other each particle has a covariance of its own, which only few states make affordable: an arm
has a hundred, and an update then takes ten times as long as with all of them sampled.

A reading that would leave only a few particles is learnt in parts [Oudjane2000]_: the largest share
of its likelihood that leaves enough particles, then the next share after resampling. Resampled
particles are jittered by a kernel that keeps the cloud's mean and covariance [Liu2001]_: otherwise
states without process noise would soon be copies of one. In a hundred dimensions a thousand
particles are overconfident all the same. With so much jitter a cloud of few dimensions loses its
shape: to keep modes apart, let `kept` be sqrt(1 - h²), with Silverman's h of n sampled states and K
particles, (4 / (n + 2) / K)^(1 / (n + 4)) [Silverman1986]_: .97 for n = 1, K = 2000. For eight
static states, .7 errs a third as much.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log
from numbers import Integral

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation, Rows, measured_rows, residual_of
from urdyn.estimate.linearised import joseph, noise_of
from urdyn.estimate.mixture import log_density, mixture_innovation, moments, normalised
from urdyn.estimate.square_root import lower_root, pseudo_inverse
from urdyn.given import given_count
from urdyn.types import Array, Gaussian, Mask, freeze

EASY = 0.5  # of the effective number at which a cloud is resampled: least that a reading may leave
LEAST = 0.01  # least share of a reading's likelihood that is learnt at once


@dataclass(frozen=True, eq=False)
class Particles:
    """A weighted cloud."""

    x: Array  # (K, n) sampled states; conditional means of the others
    cov: Array  # (1 or K, n, n) conditional covariance, zero in the sampled states
    log_weight: Array  # (K,) normalised
    draws: int = 0  # so far: with the filter's seed, all of its random state

    def __post_init__(self) -> None:
        freeze(self, "x", "cov", "log_weight")


@dataclass(frozen=True)
class ParticleFilter:
    """Bootstrap proposal, systematic resampling."""

    count: int = 1000
    threshold: float = 0.5  # resampled when the effective number falls below this fraction
    # False: sample every state, as the paper does; None: do so unless one covariance serves all
    marginalise: bool | None = None
    seed: int = 0
    kept: float = 0.7  # [-] share of its distance from the mean that a resampled particle keeps

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", given_count(self.count, "count"))
        if not 0.0 <= self.threshold <= 1.0:
            raise InputError(f"threshold {self.threshold}: a fraction of the particles, 0 to 1")
        if not (isinstance(self.seed, Integral) and self.seed >= 0):
            raise InputError(f"seed {self.seed}: takes a whole number, 0 or more")
        if not 0.0 <= self.kept <= 1.0:
            raise InputError(f"kept {self.kept}: a fraction of a distance, 0 to 1")

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
        cloud = replace(state, x=x, cov=cov, draws=state.draws + 1)
        sight = seen = _sight(model, cloud, u, y)
        predicted = moments(np.exp(cloud.log_weight), seen.expected, seen.cov(1.0))
        left, told = 1.0, 0.0
        while left:
            share, weight, gained = self._bearable(cloud, sight, left)
            cloud = _corrected(replace(cloud, log_weight=weight), sight, share)
            left, told = left - share, told + gained
            if _effective(cloud.log_weight) < self.threshold * self.count:
                cloud = _resampled(cloud, self.kept, rng)
            if left:
                sight = _sight(model, cloud, u, y)
        return cloud, mixture_innovation(y, seen.rows, predicted, told)

    def belief(self, state: Particles) -> Gaussian:
        """Mean and covariance of the cloud."""
        return moments(np.exp(state.log_weight), state.x, state.cov)

    def shifted(self, state: Particles, by: Array) -> Particles:
        """The same cloud about states that have all moved by known amounts, (n,)."""
        return replace(state, x=state.x + by)

    def _sampled(self, model: TwoSlice[U]) -> Mask:
        affine = model.linear.all()
        marginalise = affine if self.marginalise is None else self.marginalise
        return ~model.linear if marginalise else np.ones(len(model.names), dtype=bool)

    def _bearable(self, cloud: Particles, sight: _Sight, left: float) -> tuple[float, Array, float]:
        """Share of the likelihood, at most `left`, that leaves enough particles; its `_weighed`."""
        fewest = EASY * self.threshold * self.count
        weight, told = _weighed(cloud, sight, left)
        if left <= LEAST or _effective(weight) >= fewest:
            return left, weight, told
        from scipy.optimize import brentq  # 37 MB, which no other filter should load

        def spare(logarithm: float) -> float:
            return _effective(_weighed(cloud, sight, np.exp(logarithm))[0]) - fewest

        share = LEAST
        if spare(log(LEAST)) > 0.0:
            share = float(np.exp(brentq(spare, log(LEAST), log(left), xtol=0.01)))
        return share, *_weighed(cloud, sight, share)

    def _rng(self, draws: int) -> np.random.Generator:
        return np.random.default_rng((self.seed, draws))


def _draw(mean: Array, cov: Array, sampled: Mask, rng: np.random.Generator) -> tuple[Array, Array]:
    """Sample states `sampled` of N(mean (K, n), cov (1 or K, n, n)); condition the rest on them."""
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


@dataclass(frozen=True, eq=False)
class _Sight:
    """A cloud's predictions of a reading, and the residuals."""

    expected: Array  # (K, r)
    residual: Array  # (K, r)
    H: Array  # (1 or K, r, n)
    HP: Array  # (1 or K, r, n)
    own: Array  # (1 or K, r, r) covariance of the prediction
    R: Array  # (r, r)
    rows: Rows  # measured

    def cov(self, share: float) -> Array:
        """S for this share of a reading's likelihood, (1 or K, r, r)."""
        return self.own + self.R / share


def _sight(model: TwoSlice[U], cloud: Particles, u: U, y: Array) -> _Sight:
    rows, (_, n) = measured_rows(y), cloud.x.shape
    whole = model.observe(cloud.x, u)
    expected, R = whole[:, rows], noise_of(model, u, whole)[rows][:, rows]
    H = HP = np.zeros((1, len(R), n))
    if cloud.cov.any():
        H = model.observe_jacobian(cloud.x, u)[..., rows, :]
        HP = H @ cloud.cov
    own = HP @ np.swapaxes(H, -1, -2)
    return _Sight(expected, residual_of(y, rows, expected), H, HP, own, R, rows)


def _weighed(cloud: Particles, sight: _Sight, share: float) -> tuple[Array, float]:
    """Log weights after a share of the likelihood, (K,), and the log of that share's evidence."""
    density = log_density(sight.residual, sight.cov(share))
    weight, total = normalised(cloud.log_weight + density)
    if share < 1.0:  # a Gaussian's power is Gaussian, with R / share, up to its peak value
        top = np.zeros_like(sight.residual[:1])
        whole, part = (float(log_density(top, R)[0]) for R in (sight.R, sight.R / share))
        total += share * whole - part
    return weight, total


def _corrected(cloud: Particles, sight: _Sight, share: float) -> Particles:
    """Kalman's correction of the states not sampled, by a share of a reading."""
    if not sight.HP.any():
        return cloud
    gain = np.swapaxes(np.linalg.solve(sight.cov(share), sight.HP), -1, -2)
    moved = cloud.x + np.squeeze(gain @ sight.residual[..., None], -1)
    cov = joseph(cloud.cov, gain, sight.H, sight.HP, sight.R / share)
    return replace(cloud, x=moved, cov=cov)


def _effective(log_weight: Array) -> float:
    """Effective number of particles."""
    return 1.0 / float(np.exp(2.0 * log_weight).sum())


def _resampled(cloud: Particles, kept: float, rng: np.random.Generator) -> Particles:
    """Systematic resampling [Kitagawa1996]_, then jitter that keeps the moments."""
    own = moments(np.exp(cloud.log_weight), cloud.x, np.zeros_like(cloud.cov[:1]))
    K = len(cloud.log_weight)
    ladder = (np.arange(K) + rng.random()) / K
    edges = np.cumsum(np.exp(cloud.log_weight))
    chosen = np.minimum(np.searchsorted(edges, ladder), K - 1)
    cov = cloud.cov if len(cloud.cov) == 1 else cloud.cov[chosen]
    anew = rng.standard_normal(cloud.x.shape) @ lower_root(own.cov).T
    x = own.mean + kept * (cloud.x[chosen] - own.mean) + np.sqrt(1.0 - kept**2) * anew
    return replace(cloud, x=x, cov=cov, log_weight=np.full(K, -np.log(K)))
