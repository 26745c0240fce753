"""What was found: one fault, one finding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdyn.diagnose.kinds.evidence import Evidence
from urdyn.io.run_folder import SEVERITIES


@dataclass(frozen=True)
class Finding:
    """A fault: what, which joint, since when, how bad, how sure, and when it will matter."""

    id: str
    kind: str
    joint: int | None  # from 0; of a collision the link it moves; None: the tool
    name: str  # of the joint, of the link, or "tool"
    onset_s: float  # [s] likeliest, on the stream's clock
    onset_interval_s: tuple[float, float]  # [s] 90 %
    alarm_s: float  # [s] when it was first reported
    severity: str  # of SEVERITIES
    confidence: float  # [-] probability that kind and joint are right
    # To the critical level: median, lo, hi (90 %), from `forecast["at_s"]` on, some 5 s before a
    # log's end; None: it does not grow. To the warning level: `forecast["to_warning_s"]`.
    time_to_failure_s: Mapping[str, float] | None
    size: float  # in `unit`
    size_sd: float  # NaN (null in JSON) for fast kinds, but pushes and loops that ring for a while
    quantity: str
    unit: str
    text: str  # one sentence
    advice: str
    evidence: Mapping[str, Any] = field(default_factory=dict)
    acknowledged: bool = False
    forecast: Mapping[str, Any] | None = None  # `Course.forecast`; None: no trend is established
    # It may have begun before the run: then onset_s, and the lower end of its interval, are when it
    # could first be seen.
    older: bool = False
    gone: bool = False  # nothing is left of it: it was repaired, or passed
    # [s] a minute or more without work, in which it may have come; None: none was near its onset
    pause_s: tuple[float, float] | None = None

    @property
    def chance(self) -> float:
        """How far its size may be off by chance, [unit]: 2 sd, or 0 where that is unknown."""
        return 2.0 * float(np.nan_to_num(self.size_sd))

    @property
    def says(self) -> Evidence:
        """Its evidence, by type."""
        return Evidence(self.evidence)

    def plain(self) -> dict[str, Any]:
        """As numbers and words, for JSON."""
        return dict(vars(self))


def severity(size: float, warning: float, critical: float) -> str:
    """Severity by the levels of the kind."""
    return SEVERITIES[int(abs(size) >= warning) + int(abs(size) >= critical)]
