"""The numbers that a diagnosis receives of an instant.

t, q, v, a, jerk, current, temperature, shift, instrument, s, travelled: (1 + 10 J,)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from urdyn.types import Array, Mask

if TYPE_CHECKING:
    from urdyn.tracking import Reading

SERIES = 10  # of J numbers each, after the time
ANGLE, CURRENT = 0, 4  # of these


def row(reading: Reading) -> Array:
    """The numbers of an instant, (1 + 10 J,)."""
    i = reading.instant
    seen = i.q, i.v, i.a, i.jerk, i.current, i.temperature, i.shift, i.instrumental
    return np.concatenate([[i.t], *seen, reading.inputs.s, reading.travelled])


def blank(t: float, silent: Mask, current: Array) -> Array:
    """An instant at which some joints' angles were not measured, (J,), likewise."""
    series = np.full((SERIES, len(silent)), np.nan)
    series[ANGLE], series[CURRENT] = np.where(silent, np.nan, 0.0), current
    return np.concatenate([[t], series.ravel()])
