"""A row of a run's history: the belief in the parameters at one instant.

t; every quantity's mean and sd; currents of every joint, measured and predicted; surprise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.tracking.belief.reading import Reading
from urdyn.types import Array

RATE = 10.0  # [Hz] most rows
FINE = 128.0  # steps per sd, for means and for the sd itself: nothing finer is known
FINEST = 2.0**-12  # [A] finest step of a current


def columns(names: Sequence[str], units: Sequence[str], joints: int) -> list[tuple[str, str, type]]:
    """Name, unit and type of each; `names` are those of the quantities."""
    pairs = zip(names, units, strict=True)
    told = [(f"{name}{what}", unit) for name, unit in pairs for what in ("", ".sd")]
    currents = [(f"{what}_{j}", "A") for what in ("current", "predicted") for j in range(joints)]
    numbers = [(*of, float) for of in [("t", "s"), *told, *currents, ("nis", "-")]]
    return [*numbers, ("measured", "", int), ("widened", "", bool)]


def spacing(period: float) -> int:
    """Samples from one row to the next, at a `period` [s]."""
    return max(1, int(np.ceil(1.0 / (RATE * period) - 0.01)))


def row(reading: Reading, mean: Array, sd: Array) -> Array:
    """One row, its numbers no finer than they are known: a day takes some 70 MB."""
    told = np.stack([_rounded(mean, sd / FINE), _rounded(sd, sd / FINE)], axis=1).ravel()
    currents = _rounded(np.concatenate([reading.current, reading.predicted]), FINEST)
    end = reading.innovation.nis, reading.innovation.measured, reading.widened
    return np.concatenate([[reading.t], told, currents, end])


def _rounded(values: Array, step: Array | float) -> Array:
    """Round to the power of two below `step`: a tenth of the bytes, once compressed."""
    grid = np.exp2(np.floor(np.log2(np.where(step > 0.0, step, 1.0))))
    return np.where(step > 0.0, np.round(values / grid) * grid, values)
