"""Numbers as JSON has them."""

from __future__ import annotations

import math


def plain(value: float) -> float | None:
    """A number; null where it is none, or beyond all."""
    return float(value) if math.isfinite(value) else None
