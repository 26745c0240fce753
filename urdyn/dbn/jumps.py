"""Hypotheses about sudden change: at some slice, and only there, the state jumps.

Each alternative is a Gaussian, a step and a spread around it; without a spread it is a known step.

A jump of a rate (`Trend` has rates) is the beginning of the paper's ramp, eq. 5 and 6: a fault that
grows. A jump of a mass is a payload that is picked up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_each, given_sd
from urdyn.types import Array, freeze, index_of


@dataclass(frozen=True, eq=False)
class Jumps:
    """A set of alternatives: which states jump, and how far."""

    step: Array  # (D, n) added to the state
    weight: Array  # (D,) prior weights, given that there is a jump; sum 1
    # (K, n) sd around the steps: one row per D / K of them, in their order, or (n,) for all.
    spread: Array = field(default_factory=lambda: np.zeros(()))

    def __post_init__(self) -> None:
        freeze(self, "step", "weight")
        if self.step.ndim != 2 or self.weight.shape != self.step.shape[:1]:
            raise InputError(
                f"steps {self.step.shape} and weights {self.weight.shape}: one row, one weight"
            )
        if not ((self.weight > 0.0).all() and np.isclose(self.weight.sum(), 1.0)):
            raise InputError(f"weights {self.weight}: each above 0, and together 1")
        given_each(self.step, "step", self.step.shape)
        (count, n), shape = self.step.shape, np.shape(self.spread)
        rows = shape[0] if len(shape) == 2 else 1
        if shape not in ((), (n,), (rows, n)) or not rows or count % rows:
            raise InputError(
                f"spread {shape}: one for each of {n} states, or rows of these, each for as many "
                f"of the {count} steps"
            )
        spread = np.broadcast_to(self.spread, shape or (n,))
        object.__setattr__(self, "spread", np.atleast_2d(given_sd(spread, "spread", spread.shape)))


def jumps(
    names: tuple[str, ...], states: Sequence[str], sizes: Array, spread: float = 0.0
) -> Jumps:
    """Jumps of each of `states` alone by each of `sizes` (r,) +- `spread`, equally likely."""
    if not (len(states) and len(sizes)):
        raise InputError("jumps want one state or more, and one size or more")
    step = np.zeros((len(states), len(sizes), len(names)))
    sd = np.zeros((len(states), len(names)))
    for alone, state in enumerate(states):
        at = index_of(state, names, "state")
        step[alone, :, at] = sizes
        sd[alone, at] = spread
    count = len(states) * len(sizes)
    spreads = sd if spread else sd[0]  # without one, 0 for all
    return Jumps(step.reshape(count, len(names)), np.full(count, 1.0 / count), spreads)
