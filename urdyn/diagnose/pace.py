"""How many rows are a chunk, a beat and a moment, and when a gap ends them early."""

from __future__ import annotations

from dataclasses import dataclass

from urdyn.signal.stretches import GAP

CHUNK = 10  # rows that are compared with the model at once
BEAT = 0.25  # [s]


@dataclass(frozen=True)
class Pace:
    """That of rows so far apart."""

    period: float  # [s]

    @property
    def gap(self) -> float:
        """Between stamps after which a beat and a moment end early, at least [s]."""
        return GAP * self.period

    @property
    def beat(self) -> int:
        """Rows of a beat."""
        return max(1, round(BEAT / self.period))

    @property
    def chunk(self) -> int:
        """Rows of which a few make a beat; the last of them may be fewer."""
        return -(-self.beat // -(-self.beat // CHUNK))

    def lasted(self, first: float, last: float, length: float) -> bool:
        """Whether what began and ended with these rows is that long [s]; half a row a beat less."""
        slack = 0.51 * self.period * round(length / BEAT)  # and what stamps are rounded by
        return bool(last - first + self.period >= length - slack)
