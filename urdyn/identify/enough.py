"""How much of a recording tells anything of an arm."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

MIN_ROWS = 200


def too_few(current: Array) -> str:
    """Why currents (N, J) [A] tell nothing; nothing where there are enough."""
    measured = np.isfinite(current).any(axis=1).sum()
    if measured >= MIN_ROWS:
        return ""
    told = f"{measured} rows with a current are too few"
    return f"{told}; record at least {MIN_ROWS}, better 20 s of motion of every joint"
