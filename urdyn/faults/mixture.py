"""Likelihood of a step's innovations under each alternative, for the tests that share it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from urdyn.errors import InputError
from urdyn.faults.alternatives import CLIP, Cells, cells
from urdyn.given import given_rows, given_side, given_streams, given_tolerance
from urdyn.types import Array, frozen

AT_ONCE = 10_000  # healthy innovations, each of which takes H numbers


@dataclass(frozen=True, eq=False)
class Mixture:
    """Alternatives for streams whose healthy innovations have a spread of one at most."""

    alternatives: Cells = field(default_factory=cells)
    side: Array | float = 0.0  # (n,) or one for all: +1 only a rise matters, -1 a fall, 0 both
    tolerance: Array | float = 0.0  # (n,) or one [sd]: a change of the mean that is no fault
    healthy: Array | None = None  # (N, n) [sd] innovations while healthy; None: normal

    def __post_init__(self) -> None:
        object.__setattr__(self, "side", frozen(given_side(self.side)))
        object.__setattr__(self, "tolerance", frozen(given_tolerance(self.tolerance)))
        if self.healthy is not None:
            rows = given_rows(self.healthy, "what healthy innovations were")
            if not np.isfinite(rows).any(axis=0).all():
                raise InputError("healthy innovations: of each stream one is needed that is finite")
            object.__setattr__(self, "healthy", frozen(rows))

    def given_streams(self, streams: object) -> int:
        """Number of streams, 1 or more; InputError where the settings have another."""
        n = given_streams(streams)
        given_side(self.side, n)
        given_tolerance(self.tolerance, n)
        if self.healthy is not None and self.healthy.shape[1] != n:
            raise InputError(f"healthy innovations are of {self.healthy.shape[1]} streams, not {n}")
        return n

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

    @cached_property
    def _more(self) -> Array:
        """Excess of psi over a normal's, (n or 1, H), so that E L <= 1 on skewed noise, too."""
        if self.healthy is None:
            return np.zeros((1, len(self.alternatives)))
        n = self.healthy.shape[1]
        sides = (np.broadcast_to(x, (n,)) for x in self._sides)
        return np.asarray([self._excess(*of) for of in zip(self.healthy.T, *sides, strict=True)])

    def _excess(self, healthy: Array, side: float, slack: float) -> Array:
        """ln E L over one stream's healthy innovations, (H,), 0 or more."""
        seen = healthy[np.isfinite(healthy)]
        parts = np.array_split(seen, 1 + len(seen) // AT_ONCE)
        L = sum(np.exp(self._exponent(part, side, slack)).sum(axis=0) for part in parts)
        return np.asarray(np.log(np.maximum(L / len(seen), 1.0)))

    def likelihood(self, observed: Array, wider: Array | float = 1.0) -> Array:
        """Likelihood of innovations (n,) [sd] under each cell, over that while healthy, (n, H).

        A variance is judged by the innovations before their division by `wider`.
        """
        e = np.where(np.isfinite(observed), observed, 0.0)
        exponent = self._exponent(e, *self._sides, wider)
        exponent -= self._more
        return np.asarray(np.exp(exponent, out=exponent))

    def _exponent(
        self, e: Array, side: Array | float, slack: Array | float, wider: Array | float = 1.0
    ) -> Array:
        """tilt g - psi of innovations (n,) [sd], with a normal's psi, (n, H)."""
        grown = np.empty((4, len(e)))
        np.subtract(e, slack, out=grown[0])
        np.subtract(-e, slack, out=grown[1])
        size = np.where(side == 0.0, np.abs(e), side * e)
        np.maximum(wider * (size - slack), 0.0, out=grown[2])
        np.clip(grown[:3], -CLIP, CLIP, out=grown[:3])
        grown[2] *= grown[2]
        grown[3] = 1.0
        return np.asarray(grown.T @ self._gather)

    @staticmethod
    def unless_missing(after: Array, before: Array, observed: Array) -> Array:
        """Evidence (n, H): that of a stream that was not measured stays as it was."""
        measured = np.isfinite(observed)
        return after if measured.all() else np.where(measured[:, None], after, before)

    def explanation(self, evidence: Array) -> tuple[str, float]:
        """The leading alternative in one stream's evidence (H,), and its age [steps] or NaN."""
        cell = self.alternatives
        leading = int(evidence.argmax())
        if not evidence[leading] > 0.0:
            return "", np.nan
        alike = cell.kind == cell.kind[leading]
        age = float(evidence[alike] @ cell.age[alike] / evidence[alike].sum())
        return cell.kinds[int(cell.kind[leading])], age
