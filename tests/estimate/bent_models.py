"""A model that is not affine: the product of a gain and a level, of which the level is linear."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn import Slice
from urdyn.types import Array, Gaussian, Mask


@dataclass(frozen=True, eq=False)
class Product:
    """y0 = exp(gain) level + e, y1 = level + e; the paper's drive gain beside what it drives."""

    sd: float = 0.3  # of the prior
    wander: float = 0.02  # of both states, per step
    noise: float = 0.1

    names = ("gain", "level")

    @cached_property
    def prior(self) -> Gaussian:
        return Gaussian(np.array([0.0, 1.0]), self.sd**2 * np.eye(2))

    @cached_property
    def linear(self) -> Mask:
        return np.array([False, True])

    affine_transition = True
    still = False

    def transition(self, x: Array, u: Slice) -> Array:
        return x

    def transition_jacobian(self, x: Array, u: Slice) -> Array:
        return np.eye(2)

    def transition_cov(self, u: Slice) -> Array:
        return self.wander**2 * u.dt * np.eye(2)

    def observe(self, x: Array, u: Slice) -> Array:
        return np.stack([np.exp(x[..., 0]) * x[..., 1], x[..., 1]], axis=-1)

    def observe_jacobian(self, x: Array, u: Slice) -> Array:
        gain, one, zero = np.exp(x[..., 0]), np.ones_like(x[..., 0]), np.zeros_like(x[..., 0])
        rows = [np.stack([gain * x[..., 1], gain], -1), np.stack([zero, one], -1)]
        return np.stack(rows, axis=-2)

    def observe_cov(self, u: Slice) -> Array:
        return self.noise**2 * np.eye(2)


@dataclass(frozen=True, eq=False)
class Logarithm:
    """y = exp(x0) + e, among states that nothing is seen of."""

    states: int

    affine_transition = True
    still = True

    @cached_property
    def prior(self) -> Gaussian:
        return Gaussian(np.zeros(self.states), 0.25 * np.eye(self.states))

    @cached_property
    def linear(self) -> Mask:
        return np.arange(self.states) > 0

    def transition(self, x: Array, u: Slice) -> Array:
        return x

    def observe(self, x: Array, u: Slice) -> Array:
        return np.exp(x[..., :1])

    def observe_cov(self, u: Slice) -> Array:
        return 0.01 * np.eye(1)


@dataclass(frozen=True, eq=False)
class Sum:
    """y = h exp(x) + e, with as many logarithms as h has columns."""

    h: Array  # (m, n)
    sd: float = 0.3  # of the prior
    noise: float = 0.05

    affine_transition = True
    still = True

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(map(str, range(self.h.shape[1])))

    @cached_property
    def prior(self) -> Gaussian:
        n = self.h.shape[1]
        return Gaussian(np.zeros(n), self.sd**2 * np.eye(n))

    @cached_property
    def linear(self) -> Mask:
        return np.zeros(self.h.shape[1], dtype=bool)

    def transition(self, x: Array, u: Slice) -> Array:
        return x

    def observe(self, x: Array, u: Slice) -> Array:
        return np.exp(x) @ self.h.T

    def observe_jacobian(self, x: Array, u: Slice) -> Array:
        return np.exp(x)[..., None, :] * self.h

    def observe_cov(self, u: Slice) -> Array:
        return self.noise**2 * np.eye(len(self.h))

    def divergence(self, q: Gaussian, before: Gaussian, y: Array) -> float:
        """KL(q || posterior), but for a constant: exponentials of Gaussians have known moments."""
        a = self.h * np.exp(q.mean + 0.5 * np.diag(q.cov))
        square = np.einsum("ri,ij,rj->r", a, np.exp(q.cov), a)
        misfit = np.nansum(y**2 - 2.0 * y * a.sum(axis=1) + np.where(np.isnan(y), 0.0, square))
        apart = np.linalg.solve(before.cov, np.c_[q.cov, q.mean - before.mean])
        away = np.trace(apart[:, :-1]) + (q.mean - before.mean) @ apart[:, -1]
        own = away - np.linalg.slogdet(q.cov)[1]
        return float(0.5 * (misfit / self.noise**2 + own))
