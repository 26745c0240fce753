"""One protocol for every filter, and the loop that makes an online step an offline estimate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from urdyn.dbn.two_slice import TwoSlice, U
from urdyn.estimate.innovation import Innovation
from urdyn.types import Array, Gaussian, frozen

S = TypeVar("S")


class Filter(Protocol[S]):
    """Settings; all state is in the value S that goes from step to step."""

    def init(self, model: TwoSlice[U]) -> S:
        """State before the first slice."""

    def step(self, model: TwoSlice[U], state: S, u: U, y: Array) -> tuple[S, Innovation]:
        """One slice on: predict over u.dt, then learn from the finite rows of y, (m,)."""

    def belief(self, state: S) -> Gaussian:
        """Mean and covariance of the model's state, (n,), (n, n)."""


@dataclass(frozen=True, eq=False)
class Track:
    """Where the parameters went."""

    names: tuple[str, ...]  # n
    t: Array  # (N,) [s] since the first slice's predecessor, or in the steps that u.dt counts
    mean: Array  # (N, n)
    sd: Array  # (N, n)
    innovations: tuple[Innovation, ...]  # N

    def __post_init__(self) -> None:
        for name in ("t", "mean", "sd"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        shape = (len(self.t), len(self.names))
        assert self.mean.shape == self.sd.shape == shape, "one value a time and name"

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, name: str) -> Array:
        """History of one state's mean, (N,)."""
        return np.asarray(self.mean[:, self.names.index(name)])

    @property
    def log_likelihood(self) -> float:
        """Log of the marginal likelihood of all observations: what models are compared by."""
        return sum(i.log_likelihood for i in self.innovations)


def track(
    filter: Filter[S],  # noqa: A002 - the domain's word
    model: TwoSlice[U],
    inputs: Iterable[U],
    observations: Iterable[Array],
) -> Track:
    """Run `filter` over a history, one `step` a slice; observations (N, m), NaN if unmeasured."""
    state = filter.init(model)
    t, means, sds, innovations = [0.0], [], [], []
    for u, y in zip(inputs, observations, strict=True):
        state, surprise = filter.step(model, state, u, y)
        belief = filter.belief(state)
        t.append(t[-1] + u.dt)
        means.append(belief.mean)
        sds.append(belief.sd)
        innovations.append(surprise)
    shape = (len(innovations), len(model.names))
    return Track(
        model.names,
        np.array(t[1:]),
        np.reshape(means, shape),
        np.reshape(sds, shape),
        tuple(innovations),
    )
