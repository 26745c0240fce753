"""What a fast test has seen, before it is called a finding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdyn.diagnose.evidence import Evidence

CERTAIN = 0.99  # [-] that a test which alarms is right, before it is said how far to trust its name
USELESS = 10.0  # size of a sensor that tells nothing: beyond any level


@dataclass(frozen=True, eq=False)
class Event:
    """A fault that shows at once."""

    kind: str
    joint: int  # of a collision: the link
    onset: float  # [s]
    alarm: float  # [s]
    size: float  # what the kind's levels are in
    confidence: float = CERTAIN  # [-]
    evidence: Mapping[str, Any] = field(default_factory=dict)
    size_sd: float = float("nan")  # NaN: nobody knows
    within: float = 0.1  # [s] of which it began
    unseen: float = np.inf  # [s] until when it may have been there, and would not have shown
    goes_on: bool = False  # it was told before, and this is how it is by now

    @property
    def began(self) -> tuple[float, float]:
        """From when to when it may have begun [s]."""
        return min(self.onset - self.within, self.unseen), self.onset + self.within

    @property
    def says(self) -> Evidence:
        """Its evidence, by type."""
        return Evidence(self.evidence)
