"""The protocol between a model and every filter: two slices of a dynamic Bayesian network.

    x_t = transition(x_{t-1}, u_t) + w,    w ~ N(0, transition_cov(u_t))
    y_t = observe(x_t, u_t) + e,           e ~ N(0, observe_cov(u_t))

A model is a value; it keeps nothing between calls. All functions broadcast over leading axes of x,
so that sigma points, particles and a whole history are one call. What differs from slice to slice
(time passed, regressors, direction of motion) is in `u`, any frozen value with a `dt`; the model
chooses the type. The prior is the belief before the first slice; if that has `dt = 0`, it is at the
prior's own time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeGuard, TypeVar, runtime_checkable

from urdyn.dbn.arguments import Arguments
from urdyn.types import Array, Gaussian, Mask


class Slice(Protocol):
    """The minimum that the inputs of a slice contain."""

    @property
    def dt(self) -> float:
        """Time since the slice before [s]."""


@dataclass(frozen=True)
class Tick:
    """Inputs of a slice for a model that depends only on the time passed."""

    dt: float = 1.0  # [s], or steps


U = TypeVar("U", bound=Slice)
U_contra = TypeVar("U_contra", bound=Slice, contravariant=True)


class Process(Protocol[U_contra]):
    """How the state moves from one slice to the next; the inter-slice half."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the n states."""

    @property
    def prior(self) -> Gaussian:
        """Belief before the first slice: mean (n,), covariance (n, n)."""

    @property
    def linear(self) -> Mask:
        """States in which, jointly, the transition is affine for any values of the others, (n,)."""

    def transition(self, x: Array, u: U_contra) -> Array:
        """Expected next state, (..., n) -> (..., n)."""

    def transition_jacobian(self, x: Array, u: U_contra) -> Array:
        """F = d transition / d x, (..., n) -> (..., n, n); (n, n) where F is the same for all x."""

    def transition_cov(self, u: U_contra) -> Array:
        """Process noise Q of one slice, (n, n)."""


class Observation(Protocol[U_contra]):
    """How the sensors observe the state; the intra-slice half."""

    @property
    def linear(self) -> Mask:
        """States in which, jointly, `observe` is affine for any values of the others, (n,)."""

    def observe(self, x: Array, u: U_contra) -> Array:
        """Expected observation, (..., n) -> (..., m)."""

    def observe_jacobian(self, x: Array, u: U_contra) -> Array:
        """H = d observe / d x, (..., n) -> (..., m, n); (m, n) where H is the same for all x."""

    def observe_cov(self, u: U_contra) -> Array:
        """Measurement noise R of one slice, (m, m)."""


class TwoSlice(Process[U_contra], Observation[U_contra], Protocol[U_contra]):
    """A whole model: what every filter runs."""

    @property
    def linear(self) -> Mask:
        """States in which both halves are affine, which a particle filter need not sample, (n,)."""

    @property
    def affine_transition(self) -> bool:
        """Whether the transition is affine in all states."""

    @property
    def still(self) -> bool:
        """Whether nothing moves: the transition is the identity, without noise."""


@runtime_checkable
class Linearising(Protocol[U_contra]):
    """An observation with a faster way to `observe` and `observe_jacobian` together."""

    def linearised(self, x: Array, u: U_contra) -> tuple[Array, Array]:
        """Both, at x (..., n)."""


@runtime_checkable
class Narrow(Protocol[U_contra]):
    """An observation each of whose rows is a function of few arguments."""

    def arguments(self, u: U_contra) -> Arguments | None:
        """The arguments as functions of the states; None: not few."""

    def through(self, z: Array, u: U_contra) -> Array:
        """The observation at arguments z, (..., m, d) -> (..., m)."""

    def observe_cov(self, u: U_contra) -> Array:
        """Measurement noise R of one slice, (m, m)."""


@runtime_checkable
class Predicting(Protocol[U_contra]):
    """An affine process with a faster way to predict a Gaussian than by points."""

    def predicted(self, belief: Gaussian, u: U_contra) -> Gaussian | None:
        """Moments of the next state by `transition` and `transition_cov`; None: no faster way."""


def predicted(model: Process[U], belief: Gaussian, u: U) -> Gaussian | None:
    """The belief about the next state, where there is a faster way to it."""
    return model.predicted(belief, u) if _predicts(model) else None


def linearised(model: Observation[U], x: Array, u: U) -> tuple[Array, Array]:
    """`observe` and `observe_jacobian` at x, by the faster way where there is one."""
    if _linearises(model):
        return model.linearised(x, u)
    return model.observe(x, u), model.observe_jacobian(x, u)


def is_narrow(model: Observation[U]) -> TypeGuard[Narrow[U]]:
    """Whether it is `Narrow`."""
    return able(type(model), Narrow)


def _linearises(model: Observation[U]) -> TypeGuard[Linearising[U]]:
    return able(type(model), Linearising)


def _predicts(model: Process[U]) -> TypeGuard[Predicting[U]]:
    return able(type(model), Predicting)


@cache
def able(kind: type, ability: type) -> bool:
    """Whether a class has an ability, cached: checking a protocol is slow."""
    return issubclass(kind, ability)
