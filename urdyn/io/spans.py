"""Times to come, in the units that people use."""

from __future__ import annotations

from collections.abc import Mapping

NEVER = 1e9  # [s] that may as well be for ever
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"))


def span(seconds: float | None) -> str:
    """A time, in the largest unit of which it has two."""
    length, name = _unit_of(seconds)
    return f"{_in(seconds, length)} {name}".strip()


def span_of(left: Mapping[str, float | None]) -> str:
    """A time to a level, with its 90 % interval in the same unit."""
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
    value = seconds / length
    return f"{value:.{1 if abs(value) < 9.95 else 0}f}".replace("-", "−")
