"""The subject of slow kinds: a change that lasts; and pushes, which do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Push:
    """Whether something pushes the arm now, and when something did."""

    going: bool = False
    begin: float = np.inf  # [s]
    end: float = -np.inf  # [s]

    def within(self, begin: float, end: float) -> bool:
        """Whether it overlaps this interval."""
        return self.begin <= end and begin <= self.end


@dataclass(frozen=True, eq=False)
class Change:
    """A change that lasts."""

    suspect: int  # index among all suspects
    onset: float  # [s] likeliest
    shown: tuple[float, float]  # [s] 5 and 95 % of the bank's onset that first shows it
    began: tuple[float, float]  # [s] 5 and 95 %
    alarm: float  # [s]
    confidence: float  # [-]
    evidence: float  # [nats] beyond the healthy arm
    size: float  # of the change, in the unit of the state that measures it
    size_sd: float
    rate: float  # [1/s]; 0 for a step
    rate_sd: float
    detail: tuple[float, ...] = ()  # of a payload: mass, mx, my, mz
    rivals: tuple[tuple[int, float], ...] = ()  # other suspects and their shares
    older: bool = False  # it may be older than the run
    pause: tuple[float, float] | None = None  # [s] in which it may have come

    def among(self, share: Sequence[float]) -> Change:
        """The same, compared with its rivals.

        Args:
            share: of each suspect in what explains the same, (h,) [-].
        """
        others = sorted((-x, k) for k, x in enumerate(share) if x and k != self.suspect)
        rivals = tuple((k, -x) for x, k in others[:2])
        return replace(self, confidence=self.confidence * share[self.suspect], rivals=rivals)
