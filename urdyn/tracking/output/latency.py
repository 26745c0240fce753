"""Durations over an endless run, in constant memory."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

EDGES: Array = np.geomspace(1e-6, 1e3, 2001)  # [s] neighbours are 1 % apart


class Latency:
    """A histogram of durations; quantiles are accurate to 1 %, the longest is exact."""

    def __init__(self) -> None:
        self.longest = 0.0  # [s]
        self.total = 0.0  # [s]
        self.count = 0
        self._counts = np.zeros(len(EDGES) + 1, dtype=np.int64)

    def take(self, duration: float) -> None:
        """Count one duration [s]."""
        self._counts[np.searchsorted(EDGES, duration)] += 1
        self.longest = max(self.longest, duration)
        self.total += duration
        self.count += 1

    def quantile(self, share: float) -> float:
        """Duration that this share of them does not exceed [s]; 0 where there are none."""
        place = int(np.searchsorted(np.cumsum(self._counts), share * self.count))
        return float(min(EDGES[min(place, len(EDGES) - 1)], self.longest))

    def summary(self) -> dict[str, float]:
        """Quantiles and maximum, in milliseconds."""
        durations = {"p50": self.quantile(0.5), "p99": self.quantile(0.99), "max": self.longest}
        return {name: 1e3 * duration for name, duration in durations.items()}
