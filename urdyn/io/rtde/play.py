"""play(): a log -> the samples that a controller sends."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

import numpy as np

from urdyn.io.rtde.fields import TYPES, outputs
from urdyn.io.rtde.recipe import Values
from urdyn.types import Array, Log

LATEST = (10, 12)  # release that knows every output


def play(log: Log, *, loop: bool = False) -> Iterator[Values]:
    """Rows of a log as samples, one per control cycle, once or over and over.

    Stamps are the log's own; every further round goes on one median step after the last.
    """
    step = float(np.median(np.diff(log.t))) if len(log) > 1 else 0.0
    length = float(log.t[-1] - log.t[0]) + step
    known = outputs(LATEST)
    values = {name: column for name, column in log.channels.items() if name in known}
    whole = {name for name in values if "f" not in TYPES[known[name]][0]}
    for turn in count() if loop else range(1):
        for row, stamp in enumerate(log.t):
            yield {"timestamp": stamp + turn * length, **_row(values, row, whole)}


def _row(values: dict[str, Array], row: int, whole: set[str]) -> Values:
    """One row; an integer has no NaN, so what was not measured is left out."""
    cells = {name: column[row] for name, column in values.items()}
    return {name: cell for name, cell in cells.items() if name not in whole or _finite(cell)}


def _finite(cell: Array) -> bool:
    return bool(np.isfinite(cell).all())
