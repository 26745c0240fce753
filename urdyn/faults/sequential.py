"""The test that keeps a promise: Shiryaev-Roberts over a mixture, an e-detector [Shin2024]_.

R is the sum over all past onsets of the likelihood ratio of "it began then, and is here now":

    R_t = L(y_t) (R_{t-1} T + entry),      M_t = mean over streams of sum over cells of R_t.

While all streams are healthy E L <= 1, so that M_t - t is a supermartingale however the streams
depend on each other, and the mean time to M >= N is N or more: the threshold is the promise itself.
[Shiryaev1963]_ [Roberts1966]_
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.faults.gathering import Gathering
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class ShiryaevRoberts(Gathering):
    """All onsets together."""

    def carried(self, R: Array) -> Array:
        """R T + entry."""
        cell = self.alternatives
        after = cell.stay * R + self.mixture.entry
        after[:, 1:] += cell.move[1:] * R[:, :-1]
        return np.asarray(after)

    def verdict(self, R: Array) -> tuple[float, Array, Array]:
        """The mean over streams."""
        streams = R.sum(axis=1) / (self.promise * len(R))
        return float(streams.sum()), streams, R[streams.argmax()]
