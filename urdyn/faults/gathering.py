"""What tests that gather evidence over onsets share: the settings, and what an innovation weighs.

Of every stream and cell the state holds R, the evidence that a change began at some time and is in
this cell now. Tests differ in how it is carried on, and in how it comes to a verdict.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from urdyn.faults.alternatives import Cells, cells
from urdyn.faults.detector import Verdict
from urdyn.faults.mixture import Mixture
from urdyn.faults.robust import swings
from urdyn.given import given_a, given_promise, given_step, given_tolerance
from urdyn.types import Array, freeze

MOST = 1e150  # evidence counts no further: an alarm that goes on unacknowledged stays finite


@dataclass(frozen=True, eq=False)
class Onsets:
    """Evidence gathered so far."""

    R: Array  # (n, H) [steps]

    def __post_init__(self) -> None:
        freeze(self, "R")


@dataclass(frozen=True, eq=False)
class Gathering(ABC):
    """At most one false alarm in `promise` steps over all streams, for standardised innovations.

    Healthy innovations have a conditional mean of at most `tolerance` and a spread of at most one;
    `Whitened` makes such of raw ones, and shows those of its baseline, whose skew is then granted.
    """

    promise: float = 10_000.0  # [steps] to a false alarm, at least, on the average
    alternatives: Cells = field(default_factory=cells)
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is none
    healthy: Array | None = None  # (N, n) [sd] innovations while healthy; None: normal ones

    def __post_init__(self) -> None:
        given_promise(self.promise)
        given_a(self.alternatives, Cells, "alternatives", "as cells() gives")
        _ = self.mixture  # refuses what cannot be looked for

    @cached_property
    def mixture(self) -> Mixture:
        """What is looked for."""
        return Mixture(self.alternatives, self.side, self.tolerance, self.healthy)

    def taught(self, healthy: Array) -> Self:
        """Its promise is kept on innovations like these, (N, n) [sd], skewed or swinging."""
        slack = given_tolerance(self.tolerance, healthy.shape[1])
        return replace(self, healthy=healthy, tolerance=slack + swings(healthy))

    @abstractmethod
    def carried(self, R: Array) -> Array:
        """Evidence (n, H) a step later, before anything is seen."""

    @abstractmethod
    def verdict(self, R: Array) -> tuple[float, Array, Array]:
        """Evidence over the threshold: of all, of each stream (n,); and that which leads (H,)."""

    def init(self, streams: int) -> Onsets:
        """Nothing seen yet."""
        streams = self.mixture.given_streams(streams)
        return Onsets(np.zeros((streams, len(self.alternatives))))

    def step(self, state: Onsets, observed: Array) -> tuple[Onsets, Verdict]:
        """Weigh every cell by the innovations, (n,) [sd], NaN where there is none."""
        return self.step_beside(state, observed, np.ones(len(state.R)))

    def step_beside(self, state: Onsets, observed: Array, wider: Array) -> tuple[Onsets, Verdict]:
        """The same of innovations that were divided by `wider`, (n,): a variance's cell was not."""
        observed = given_step(observed, len(state.R))
        R = self.carried(state.R) * self.mixture.likelihood(observed, wider)
        R = self.mixture.unless_missing(np.minimum(R, MOST), state.R, observed)
        whole, streams, leading = self.verdict(R)
        kind, age = self.mixture.explanation(leading)
        return Onsets(R), Verdict(whole, streams, kind, age)

    def acknowledged(self, state: Onsets) -> Onsets:
        """Nothing seen yet."""
        return replace(state, R=np.zeros_like(state.R))
