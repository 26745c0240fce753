"""How parameters move between slices. `Joined` combines each with any observation.

All are linear and exact for any time step, as `Trend` is, and their components are independent;
noise is stated as a density, so that a belief does not depend on how often it is updated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.dbn.two_slice import Slice
from urdyn.given import given_belief, given_names, given_sd
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
