"""Times in the units that people use: moments of a run, and times to come."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

NEVER = 1e9  # [s] that may as well be for ever
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"))
AXES = ((600.0, 1.0, "s"), (3 * 3600.0, 60.0, "min"), (72 * 3600.0, 3600.0, "h"))


@dataclass(frozen=True)
class Clock:
    """The unit in which a run's time reads well."""

    seconds: float  # [s] in one unit
    unit: str

    def __call__(self, t: float) -> str:
        """A moment, as words."""
        return f"{_figures(t / self.seconds, 3)} {self.unit}"

    @property
    def axis(self) -> str:
        """Title of an axis of time."""
        return f"time [{self.unit}]"


def clock(length: float) -> Clock:
    """One unit for all times up to `length` [s], as on an axis."""
    return next((Clock(s, unit) for end, s, unit in AXES if length < end), Clock(86400.0, "d"))


def span(seconds: float | None) -> str:
    """A duration, in the largest unit of which it has at least two."""
    length, name = _unit_of(seconds)
    return f"{_in(seconds, length)} {name}".strip()


def span_of(left: Mapping[str, float | None]) -> str:
    """A median time to a level, with its 90 % interval in the same unit."""
    length, _ = _unit_of(left["median"])
    lo, hi = (_in(left[end], length) for end in ("lo", "hi"))
    return f"{span(left['median'])} ({lo} to {hi})"


def _unit_of(seconds: float | None) -> tuple[float, str]:
    if seconds is None or seconds >= NEVER:
        return 1.0, ""
    return next((unit for unit in SPANS if seconds >= 2.0 * unit[0]), (1.0, "s"))


def _in(seconds: float | None, length: float) -> str:
    if seconds is None or seconds >= NEVER:
        return "no end"
    return _figures(seconds / length, 2)


def _figures(value: float, digits: int) -> str:
    """To at most `digits` significant digits and `digits` - 1 decimals; 0 as 0."""
    value = round(value, digits - 1)
    if value == 0.0:
        return "0"
    whole = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    return f"{value:.{min(max(digits - 1 - whole, 0), digits - 1)}f}".replace("-", "−")
