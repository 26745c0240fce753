"""How far a run has come, for watchers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from urdyn.tracking.belief.payload_setting import Setting
from urdyn.tracking.belief.physical import Quantities
from urdyn.tracking.belief.reading import Reading
from urdyn.types import Array

LATE = 1.0  # [s] of delay, above which results are too late


@dataclass(frozen=True)
class RunProgress:
    """One instant of a run."""

    t: float  # [s] since the first sample
    last: float  # [s] stamp of the newest sample
    samples: int
    share: float  # [-] done, of a live run since it was resumed; 0 if unknown
    rate: float  # [Hz] updates per second of computing
    reading: Reading
    quantities: Quantities
    findings: tuple[Mapping[str, Any], ...] = ()  # as in findings.json, so far
    doubt: str = ""  # about all of these, so far
    row: bool = True  # whether it is a row of the history, for which all quantities are computed
    setting: Setting = field(default_factory=Setting)  # of the controller
    delay: float = 0.0  # [s] of the newest sample, from its arrival to now; 0: recorded
    ended: bool = False  # nothing more will come: the newest, repeated with all findings

    @property
    def behind(self) -> str:
        """By how much the run is behind its robot, in words; "" where that is little, or over."""
        return f"behind by {self.delay:.1f} s" if self.delay > LATE and not self.ended else ""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the quantities."""
        return self.quantities.names

    @property
    def units(self) -> tuple[str, ...]:
        """Of the quantities."""
        return self.quantities.units

    @property
    def mean(self) -> Array:
        """Means of the quantities, computed on demand."""
        return self._moments[0]

    @property
    def sd(self) -> Array:
        """Their standard deviations."""
        return self._moments[1]

    @cached_property
    def _moments(self) -> tuple[Array, Array]:
        return self.quantities.of(self.reading.belief, self.reading.beside)


Watch = Callable[[RunProgress], None]
