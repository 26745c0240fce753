"""Page's test: the likeliest onset alone, where Shiryaev and Roberts sum over all. [Page1954]_

    R_t = L(y_t) max(R_{t-1} T, entry)

It is at most their sum, so the promise holds with the same threshold; alarms come somewhat later.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.faults.gathering import Gathering
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Cusum(Gathering):
    """The likeliest onset."""

    def carried(self, R: Array) -> Array:
        """max(R T, entry)."""
        cell = self.alternatives
        after = np.maximum(cell.stay * R, self.mixture.entry)
        np.maximum(after[:, 1:], cell.move[1:] * R[:, :-1], out=after[:, 1:])
        return np.asarray(after)

    def verdict(self, R: Array) -> tuple[float, Array, Array]:
        """That of the leading stream."""
        streams = R.max(axis=1) / (self.promise * len(R))
        leading = int(streams.argmax())
        return float(streams[leading]), streams, R[leading]
