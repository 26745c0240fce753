"""Progress of long work, reported to a callback; without numpy, for all verbs."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  # what is being done, and the share done


def silent(doing: str, share: float) -> None:
    """Ignore progress."""
