"""What a fast test has detected, before it becomes a finding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdyn.diagnose.kinds.evidence import Evidence

CERTAIN = 0.99  # [-] confidence in an alarm, before the trust in its name is applied
USELESS = 10.0  # size of a sensor without readings: beyond any level


@dataclass(frozen=True, eq=False)
class Event:
    """A fault that shows at once."""

    kind: str
    joint: int  # of a collision: the link
    onset: float  # [s]
    alarm: float  # [s]
    size: float  # in the unit of the kind's levels
    confidence: float = CERTAIN  # [-]
    evidence: Mapping[str, Any] = field(default_factory=dict)
    size_sd: float = float("nan")  # NaN: unknown
    within: float = 0.1  # [s] about the onset, within which it began
    unseen: float = np.inf  # [s] until when it may have existed without showing
    goes_on: bool = False  # reported before; this is its present state

    @property
    def began(self) -> tuple[float, float]:
        """Interval in which it may have begun [s]."""
        return min(self.onset - self.within, self.unseen), self.onset + self.within

    @property
    def says(self) -> Evidence:
        """Its evidence, by type."""
        return Evidence(self.evidence)
