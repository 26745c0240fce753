"""How parameters move between slices. `Joined` combines each with any observation.

All are linear and exact for any time step, as `Trend` is, and their components are independent;
noise is stated as a density, so that a belief does not depend on how often it is updated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.two_slice import Slice
from urdyn.given import given_belief, given_each, given_names, given_sd, positive
from urdyn.types import Array, Gaussian, Mask, frozen


@dataclass(frozen=True, eq=False)
class RandomWalk:
    """x' = x + w, the paper's process: right for a parameter that jitters, lags on a ramp."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,), (n, n)
    diffusion: Array  # (n,) [unit/√s] standard deviation accumulated in one second

    def __post_init__(self) -> None:
        n = len(self.names)
        given_names(self.names)
        object.__setattr__(self, "diffusion", given_sd(self.diffusion, "diffusion", (n,)))
        object.__setattr__(self, "prior", given_belief(self.prior, "the prior", n))

    @cached_property
    def linear(self) -> Mask:
        """All states, (n,)."""
        return np.ones(len(self.names), dtype=bool)

    @cached_property
    def _still(self) -> Array:
        return frozen(np.eye(len(self.names)))

    def transition(self, x: Array, u: Slice) -> Array:
        """x itself, (..., n)."""
        return x

    def transition_jacobian(self, x: Array, u: Slice) -> Array:
        """Identity, (n, n)."""
        return self._still

    def transition_cov(self, u: Slice) -> Array:
        """diffusion² dt, (n, n)."""
        return np.diag(self.diffusion**2 * u.dt)


@dataclass(frozen=True, eq=False)
class MeanReverting:
    """x' - mu = exp(-dt / tau) (x - mu) + w, Ornstein-Uhlenbeck: it strays and returns."""

    names: tuple[str, ...]  # n
    prior: Gaussian  # (n,), (n, n)
    level: Array  # (n,) mu, to which it returns
    time_constant: Array  # (n,) [s] tau
    spread: Array  # (n,) stationary standard deviation

    def __post_init__(self) -> None:
        n = len(self.names)
        given_names(self.names)
        object.__setattr__(self, "level", given_each(self.level, "level", (n,)))
        object.__setattr__(self, "spread", given_sd(self.spread, "spread", (n,)))
        memory = given_each(self.time_constant, "time_constant", (n,), "times above 0 s", positive)
        object.__setattr__(self, "time_constant", memory)
        object.__setattr__(self, "prior", given_belief(self.prior, "the prior", n))

    @cached_property
    def linear(self) -> Mask:
        """All states, (n,)."""
        return np.ones(len(self.names), dtype=bool)

    def _kept(self, u: Slice) -> Array:
        return np.asarray(np.exp(-u.dt / self.time_constant))

    def transition(self, x: Array, u: Slice) -> Array:
        """Closer to the level by the factor exp(-dt / tau), (..., n)."""
        return np.asarray(self.level + self._kept(u) * (x - self.level))

    def transition_jacobian(self, x: Array, u: Slice) -> Array:
        """exp(-dt / tau) on the diagonal, (n, n)."""
        return np.diag(self._kept(u))

    def transition_cov(self, u: Slice) -> Array:
        """spread² (1 - exp(-2 dt / tau)), (n, n)."""
        return np.diag(-(self.spread**2) * np.expm1(-2.0 * u.dt / self.time_constant))
