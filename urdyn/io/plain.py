"""Numbers as JSON has them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np


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


def jsonable(value: Any) -> Any:
    """The same in JSON's own types; numbers that are not finite are null."""
    match value:
        case Mapping():
            return {str(key): jsonable(inner) for key, inner in value.items()}
        case list() | tuple():
            return [jsonable(inner) for inner in value]
        case np.ndarray():
            return jsonable(value.tolist())
        case np.generic():
            return jsonable(value.item())
        case float() if not math.isfinite(value):
            return None
    return value
