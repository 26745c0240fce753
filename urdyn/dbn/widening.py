"""A process some of whose states may jump at slices that say so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from urdyn.dbn.two_slice import Process, Slice
from urdyn.types import Array, Gaussian, Index, Mask, frozen


class Doubtful(Slice, Protocol):
    """A slice that knows whether something may have jumped in it."""

    @property
    def widen(self) -> bool:
        """Whether it may."""


D = TypeVar("D", bound=Doubtful, contravariant=True)


@dataclass(frozen=True, eq=False)
class Widening(Generic[D]):
    """`process`, and at slices with `widen` what is `jumping` is known no better than `sd` again.

    A payload that is picked up is such a jump: nothing drifts there.
    """

    process: Process[D]
    jumping: Index  # (j,) states
    sd: Array  # (j,) of a jump

    def __post_init__(self) -> None:
        object.__setattr__(self, "sd", frozen(self.sd))
        assert self.sd.shape == self.jumping.shape, "one sd a state that jumps"

    @property
    def names(self) -> tuple[str, ...]:
        """Of the process."""
        return self.process.names

    @property
    def prior(self) -> Gaussian:
        """Of the process."""
        return self.process.prior

    @property
    def linear(self) -> Mask:
        """Of the process, (n,)."""
        return self.process.linear

    def transition(self, x: Array, u: D) -> Array:
        """Of the process, (..., n)."""
        return self.process.transition(x, u)

    def transition_jacobian(self, x: Array, u: D) -> Array:
        """Of the process, (n, n)."""
        return self.process.transition_jacobian(x, u)

    def transition_cov(self, u: D) -> Array:
        """Of the process, and the jump's, (n, n)."""
        Q = self.process.transition_cov(u)
        if u.widen:
            Q = Q.copy()
            Q[self.jumping, self.jumping] += self.sd**2
        return np.asarray(Q)
