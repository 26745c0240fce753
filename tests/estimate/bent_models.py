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
