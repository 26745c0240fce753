"""How far long work is, as whoever asked for it wants to hear; without numpy, for all verbs."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  # what is being done, and the share that is behind


def silent(doing: str, share: float) -> None:
    """For whoever does not want to hear."""
