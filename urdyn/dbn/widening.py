"""A process some of whose states may jump at slices that say so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from urdyn.dbn.two_slice import Process, Slice, predicted
from urdyn.given import given_each, given_places, not_negative
from urdyn.types import Array, Gaussian, Index, Mask


class Doubtful(Slice, Protocol):
    """A slice that says whether states may have jumped in it."""

    @property
    def widen(self) -> bool:
        """Whether they may."""

    @property
    def roughly(self) -> Array | None:
        """An estimate of where to, (j,), from elsewhere; None: there is none."""


D = TypeVar("D", bound=Doubtful, contravariant=True)


@dataclass(frozen=True, eq=False)
class Widening(Generic[D]):
    """`process`, in which the states `jumping` are replaced at slices with `widen`.

    The new values are believed to be the prior's mean with `sd`, regardless of the old ones. A
    payload that is picked up is such a jump, not a drift. Where `roughly` is given, the belief
    starts there instead, but just as wide, since that estimate came from the same data.
    """

    process: Process[D]
    jumping: Index  # (j,) states
    sd: Array  # (j,) of a jump

    def __post_init__(self) -> None:
        jumping = given_places(self.jumping, "jumping", len(self.names))
        object.__setattr__(self, "jumping", jumping)
        sd = given_each(self.sd, "sd", jumping.shape, "finite numbers, 0 or more", not_negative)
        object.__setattr__(self, "sd", sd)

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
        moved = self.process.transition(x, u)
        if u.widen:
            moved = np.array(moved)
            first = self.prior.mean[self.jumping]
            moved[..., self.jumping] = first if u.roughly is None else u.roughly
        return moved

    def transition_jacobian(self, x: Array, u: D) -> Array:
        """Of the process, (n, n) or (..., n, n)."""
        F = self.process.transition_jacobian(x, u)
        if u.widen:
            F = np.array(F)
            F[..., self.jumping, :] = 0.0
        return F

    def predicted(self, belief: Gaussian, u: D) -> Gaussian | None:
        """By the process, where nothing jumps."""
        return None if u.widen else predicted(self.process, belief, u)

    def transition_cov(self, u: D) -> Array:
        """That of the process, with the jump's for states that jump, (n, n)."""
        Q = self.process.transition_cov(u)
        if u.widen:
            Q = np.array(Q)
            Q[self.jumping, :] = Q[:, self.jumping] = 0.0
            Q[self.jumping, self.jumping] = self.sd**2
        return Q
