"""How likely each alternative makes a step's innovations, for the tests that share them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from urdyn.faults.alternatives import CLIP, Cells, cells
from urdyn.given import given_side, given_tolerance
from urdyn.types import Array, frozen


@dataclass(frozen=True, eq=False)
class Mixture:
    """Alternatives of streams whose healthy innovations have a spread of one at most."""

    alternatives: Cells = field(default_factory=cells)
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is none

    def __post_init__(self) -> None:
        object.__setattr__(self, "side", frozen(given_side(self.side)))
        object.__setattr__(self, "tolerance", frozen(given_tolerance(self.tolerance)))

    @cached_property
    def entry(self) -> Array:
        """(n or 1, H): the weight of a side that does not matter goes to the other."""
        cell = self.alternatives
        wanted = np.asarray(self.side)[:, None] * cell.side >= 0.0
        entry = np.where(wanted, cell.entry, 0.0)
        return np.asarray(entry / entry.sum(axis=1, keepdims=True))

    @cached_property
    def _sides(self) -> tuple[Array, Array]:
        return np.asarray(self.side), np.asarray(self.tolerance)

    @cached_property
    def _gather(self) -> Array:
        """(4, H) tilts in the row of what they tilt: rise, fall, square; and -psi."""
        cell = self.alternatives
        rows = [np.where(cell.side == side, cell.tilt, 0.0) for side in (1.0, -1.0, 0.0)]
        return np.array([*rows, -cell.psi])

    def likelihood(self, observed: Array, wider: Array | float = 1.0) -> Array:
        """Of innovations (n,) [sd] under each cell, over that of healthy ones, (n, H).

        A variance is judged by what they were before they were divided by `wider`.
        """
        e = np.where(np.isfinite(observed), observed, 0.0)
        side, slack = self._sides
        grown = np.empty((4, len(e)))
        np.subtract(e, slack, out=grown[0])
        np.subtract(-e, slack, out=grown[1])
        size = np.where(side == 0.0, np.abs(e), side * e)
        np.maximum(wider * (size - slack), 0.0, out=grown[2])
        np.clip(grown[:3], -CLIP, CLIP, out=grown[:3])
        grown[2] *= grown[2]
        grown[3] = 1.0
        exponent = grown.T @ self._gather
        return np.asarray(np.exp(exponent, out=exponent))

    @staticmethod
    def unless_missing(after: Array, before: Array, observed: Array) -> Array:
        """What was gathered, (n, H): a stream that was not measured stays where it was."""
        measured = np.isfinite(observed)
        return after if measured.all() else np.where(measured[:, None], after, before)

    def explanation(self, evidence: Array) -> tuple[str, float]:
        """The alternative that says most in one stream's (H,), and its age [steps] or NaN."""
        cell = self.alternatives
        leading = int(evidence.argmax())
        if not evidence[leading] > 0.0:
            return "", np.nan
        alike = cell.kind == cell.kind[leading]
        age = float(evidence[alike] @ cell.age[alike] / evidence[alike].sum())
        return cell.kinds[int(cell.kind[leading])], age
