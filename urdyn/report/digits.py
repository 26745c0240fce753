"""Numbers with no more digits than they deserve."""

from __future__ import annotations

import math

from urdyn.types import NORMAL90

MISSING = "–"


def number(value: float, digits: int = 2) -> str:
    """`value` to so many significant digits, never fewer than its integer part has."""
    if not math.isfinite(value):
        return MISSING
    return _fixed(value, _decimals(value, digits))


def percent(share: float) -> str:
    """A share in [0, 1] as a percentage."""
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else MISSING


def interval90(value: float, sd: float) -> str:
    """`value` and its 90 % interval, both rounded to the second digit of the half width."""
    half = NORMAL90 * sd
    if not math.isfinite(half) or half <= 0.0:
        return number(value, 3)
    decimals = _decimals(half, 2)
    return f"{_fixed(value, decimals)} ± {_fixed(half, decimals)}"


def _decimals(value: float, digits: int) -> int:
    """Decimals that show so many significant digits of `value`."""
    if value == 0.0:
        return 0
    first = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    return max(0, min(digits - 1 - first, 7))


def _fixed(value: float, decimals: int) -> str:
    rounded = round(value, decimals) + 0.0  # no "-0"
    return f"{rounded:.{decimals}f}".replace("-", "−")
