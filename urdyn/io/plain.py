"""Numbers as JSON has them."""

from __future__ import annotations

import math


def plain(value: float) -> float | None:
    """A number; null where it is none, or beyond all."""
    return float(value) if math.isfinite(value) else None


def finite(value: object) -> float | None:
    """What a file says, where that is a finite number; None: a word, true, 400 digits."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return plain(value)
    except OverflowError:
        return None
