"""How far a run is, for those who watch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from urdyn.tracking.physical import Quantities
from urdyn.tracking.reading import Reading
from urdyn.tracking.setting import Setting
from urdyn.types import Array


@dataclass(frozen=True)
class RunProgress:
    """One instant of a run."""

    t: float  # [s] since the first sample
    last: float  # [s] stamp of the newest sample
    samples: int
    share: float  # [-] that is behind, of a live run since it was taken up; 0 where nobody knows
    rate: float  # [Hz] updates a second of computing
    reading: Reading
    quantities: Quantities
    findings: tuple[Mapping[str, Any], ...] = ()  # as in findings.json, so far
    doubt: str = ""  # of all of these, likewise
    row: bool = True  # it is one of the history, for which all quantities are made
    setting: Setting = field(default_factory=Setting)  # of the controller
    ended: bool = False  # nothing more will come: the newest, told again with all that was found

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
        """Means of the quantities; made when somebody looks."""
        return self._moments[0]

    @property
    def sd(self) -> Array:
        """Their standard deviations."""
        return self._moments[1]

    @cached_property
    def _moments(self) -> tuple[Array, Array]:
        return self.quantities.of(self.reading.belief, self.reading.beside)


Watch = Callable[[RunProgress], None]
