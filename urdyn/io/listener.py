"""What receives a run's newest state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Status


class Listener(Protocol):
    """A system of the plant that receives the state."""

    def tell(self, now: Snapshot, statuses: Sequence[Status]) -> None:
        """The newest state, and a line for every joint and the arm."""

    def close(self) -> None:
        """Stop."""
