"""One protocol for every filter, and the loop that runs its online step over a history."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Protocol, TypeGuard, TypeVar, runtime_checkable

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U, able
from urdyn.errors import InputError
from urdyn.estimate.innovation import Innovation
from urdyn.types import Array, Gaussian, freeze, index_of, shaped, unmasked

S = TypeVar("S")


class Filter(Protocol[S]):
    """Learns a model's state slice by slice; all it knows is in the value S that it passes on."""

    def init(self, model: TwoSlice[U]) -> S:
        """State before the first slice."""

    def step(self, model: TwoSlice[U], state: S, u: U, y: Array) -> tuple[S, Innovation]:
        """One slice on: predict over u.dt, then learn from the finite rows of y, (m,)."""

    def belief(self, state: S) -> Gaussian:
        """Mean and covariance of the model's state, (n,), (n, n)."""


@runtime_checkable
class Shifting(Filter[S], Protocol[S]):
    """A filter that can be told how far its states jumped."""

    def shifted(self, state: S, by: Array) -> S:
        """The same belief about states that have all moved by known amounts, (n,)."""


@runtime_checkable
class GaussianFilter(Shifting[S], Protocol[S]):
    """A filter whose state is a Gaussian, in whatever form; it can be given another."""

    def with_belief(self, state: S, belief: Gaussian) -> S:
        """The state of a filter with this belief, (n,), instead."""


def is_shifting(filter_: Filter[S]) -> TypeGuard[Shifting[S]]:
    """Whether it is `Shifting`."""
    return able(type(filter_), Shifting)


def is_gaussian(filter_: Filter[S]) -> TypeGuard[GaussianFilter[S]]:
    """Whether it is a `GaussianFilter`."""
    return able(type(filter_), GaussianFilter)


@dataclass(frozen=True, eq=False)
class Track:
    """Where the parameters went."""

    names: tuple[str, ...]  # n
    # (N,) [s] since the start of the first slice, or in u.dt's steps; a log's stamps where one was
    # tracked.
    t: Array
    mean: Array  # (N, n)
    sd: Array  # (N, n)
    innovations: tuple[Innovation, ...]  # N
    cov: Array | None = field(default=None, kw_only=True)  # (N, n, n) where it was asked for

    def __post_init__(self) -> None:
        freeze(self, "t")
        shape = len(self.t), len(self.names)
        for name in ("mean", "sd"):
            object.__setattr__(self, name, shaped(name, getattr(self, name), shape))
        if self.cov is not None:
            object.__setattr__(self, "cov", shaped("cov", self.cov, (*shape, shape[1])))

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        """History of one state's mean, (N,)."""
        return np.asarray(self.mean[:, index_of(name, self.names, "state")])

    @property
    def log_likelihood(self) -> float:
        """Log of the marginal likelihood of all observations, by which models are compared."""
        return sum(i.log_likelihood for i in self.innovations)


def track(
    filter: Filter[S],
    model: TwoSlice[U],
    inputs: Iterable[U],
    observations: Iterable[Array],
    covariances: bool = False,
) -> Track:
    """Run `filter` over a history, one `step` per slice; observations (N, m), NaN if unmeasured.

    With `covariances` it keeps the joint covariance of states, 8 N n² bytes: 127 kB per slice for
    an arm's 126 states.

    Raises:
        InputError: inputs and observations do not match each other or the model.
    """
    state = filter.init(model)
    t, means, sds, covs, innovations = [0.0], [], [], [], []
    for u, y in paired(model, inputs, observations):
        state, innovation = filter.step(model, state, u, y)
        belief = filter.belief(state)
        t.append(t[-1] + u.dt)
        means.append(belief.mean)
        sds.append(belief.sd)
        if covariances:
            covs.append(belief.cov)
        innovations.append(innovation)
    shape = (len(innovations), len(model.names))
    return Track(
        model.names,
        np.array(t[1:]),
        np.reshape(means, shape),
        np.reshape(sds, shape),
        tuple(innovations),
        cov=np.reshape(covs, (*shape, shape[1])) if covariances else None,
    )


def paired(
    model: TwoSlice[U], inputs: Iterable[U], observations: Iterable[Array]
) -> Iterator[tuple[U, Array]]:
    """Each slice's inputs with its observation, (m,); InputError where they do not match."""
    shape: tuple[int, ...] = ()
    for k, (u, y) in enumerate(zip_longest(inputs, observations)):
        if u is None or y is None:
            least, most = ("inputs", "observations") if u is None else ("observations", "inputs")
            raise InputError(f"there are {k} {least} and more {most}; every slice has one of each")
        if not 0.0 <= u.dt < np.inf:
            raise InputError(f"slice {k} has dt {u.dt}: it has to be finite, and 0 or more")
        shape = shape or model.observe_cov(u).shape[:1]
        if np.shape(y) != shape:
            raise InputError(f"observation {k} has the shape {np.shape(y)}; the model's is {shape}")
        yield u, unmasked(y)
