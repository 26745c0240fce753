"""Numbers with no more digits than they deserve."""

from __future__ import annotations

import math

from urdyn.types import NORMAL90

MISSING = "–"


def number(value: float, digits: int = 2) -> str:
    """`value` to `digits` significant digits, but at least its integer part."""
    if not math.isfinite(value):
        return MISSING
    return fixed(value, _decimals(value, digits))


def hundredths(value: float | None) -> str:
    """`value` to two decimals; None was not measured."""
    return MISSING if value is None else f"{value:.2f}"


def counted(count: int, what: str) -> str:
    """A count with its noun, whose plural ends in s."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def percent(share: float) -> str:
    """A share in [0, 1] as a percentage."""
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else MISSING


def difference(share: float) -> str:
    """A change as a share, signed, in per cent; to a tenth where it is small."""
    value = 100.0 * share
    if not math.isfinite(value):
        return MISSING
    told = fixed(value, 0 if abs(value) >= 9.95 else 1)
    if float(told.replace("−", "-")) == 0.0:
        return "0 %"
    return f"{'+' if value > 0.0 else ''}{told} %"


def interval90(value: float, sd: float) -> str:
    """`value` and its 90 % interval, both rounded to the second digit of the half width."""
    half = NORMAL90 * sd
    if not math.isfinite(half) or half <= 0.0:
        return number(value, 3)
    decimals = _decimals(half, 2)
    return f"{fixed(value, decimals)} ± {fixed(half, decimals)}"


def _decimals(value: float, digits: int) -> int:
    """Decimals that show `digits` significant digits of `value`."""
    if value == 0.0:
        return 0
    first = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    return max(0, min(digits - 1 - first, 7))


def fixed(value: float, decimals: int = 0) -> str:
    """To `decimals` decimals, with a true minus sign."""
    rounded = round(value, decimals) + 0.0  # no "-0"
    return f"{rounded:.{decimals}f}".replace("-", "−")
