"""Page's test: the likeliest onset alone, where Shiryaev and Roberts sum over all. [Page1954]_

    R_t = L(y_t) max(R_{t-1} T, entry)

No more than the sum, so the promise holds with the same threshold, and somewhat later alarms.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from urdyn.faults.alternatives import Cells, cells
from urdyn.faults.detector import Verdict
from urdyn.faults.mixture import Mixture
from urdyn.faults.sequential import MOST, Onsets, require_promise
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Cusum:
    """At most one false alarm in `promise` steps over all streams, for standardised innovations."""

    promise: float = 10_000.0  # [steps] to a false alarm, at least, on the average
    alternatives: Cells = field(default_factory=cells)
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is none

    def __post_init__(self) -> None:
        require_promise(self.promise)

    @cached_property
    def _mixture(self) -> Mixture:
        return Mixture(self.alternatives, self.side, self.tolerance)

    def init(self, streams: int) -> Onsets:
        """Nothing seen yet."""
        return Onsets(np.zeros((streams, len(self.alternatives))))

    def step(self, state: Onsets, observed: Array) -> tuple[Onsets, Verdict]:
        """Weigh every cell by the innovations, (n,) [sd], NaN where there is none."""
        cell = self.alternatives
        R = np.maximum(cell.stay * state.R, self._mixture.entry)
        np.maximum(R[:, 1:], cell.move[1:] * state.R[:, :-1], out=R[:, 1:])
        R *= self._mixture.likelihood(observed)
        np.minimum(R, MOST, out=R)
        R = self._mixture.unless_missing(R, state.R, observed)
        streams = R.max(axis=1) / (self.promise * len(R))
        leading = int(streams.argmax())
        kind, age = self._mixture.explanation(R[leading])
        return Onsets(R), Verdict(float(streams[leading]), streams, kind, age)

    def acknowledged(self, state: Onsets) -> Onsets:
        """Nothing seen yet."""
        return replace(state, R=np.zeros_like(state.R))
