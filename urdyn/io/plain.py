"""Numbers as JSON has them."""

from __future__ import annotations

import math


def plain(value: float) -> float | None:
    """A number; None where it is NaN or infinite."""
    return float(value) if math.isfinite(value) else None


def finite(value: object) -> float | None:
    """A value from a file if it is a finite number; None for a word, true, 400 digits."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return plain(value)
    except OverflowError:
        return None
