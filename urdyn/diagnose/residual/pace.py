"""How many rows are a chunk, a beat and a moment, and when a gap ends them early."""

from __future__ import annotations

from dataclasses import dataclass

from urdyn.signal.stretches import GAP

CHUNK = 10  # rows compared with the model at once
BEAT = 0.25  # [s]


@dataclass(frozen=True)
class Pace:
    """The pace of rows at this period."""

    period: float  # [s]

    @property
    def gap(self) -> float:
        """Least gap between stamps that ends a beat and a moment early [s]."""
        return GAP * self.period

    @property
    def beat(self) -> int:
        """Rows of a beat."""
        return max(1, round(BEAT / self.period))

    @property
    def chunk(self) -> int:
        """Rows of a chunk, of which a few make a beat; the last may be shorter."""
        return -(-self.beat // -(-self.beat // CHUNK))

    def lasted(self, first: float, last: float, length: float) -> bool:
        """Whether the span of these rows has that length [s], less half a row per beat."""
        slack = 0.51 * self.period * round(length / BEAT)  # and the stamps' rounding
        return bool(last - first + self.period >= length - slack)
