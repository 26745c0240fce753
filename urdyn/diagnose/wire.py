"""What a diagnosis is told of an instant, as numbers.

t, q, v, a, jerk, current, temperature, shift, instrument, s, travelled: (1 + 10 J,)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from urdyn.types import Array

if TYPE_CHECKING:
    from urdyn.tracking import Reading

SERIES = 10  # of J numbers each, after the time


def row(reading: Reading) -> Array:
    """An instant's, (1 + 10 J,)."""
    i = reading.instant
    seen = i.q, i.v, i.a, i.jerk, i.current, i.temperature, i.shift, i.instrumental
    return np.concatenate([[i.t], *seen, reading.inputs.s, reading.travelled])
