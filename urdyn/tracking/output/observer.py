"""Observers of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from urdyn.tracking.belief.reading import Reading
from urdyn.types import Array, Mask


class Observer(Protocol):
    """Observes a run, and remembers where a killed run goes on."""

    def begin(self, folder: Path, index: int, identity: Mapping[str, str]) -> None:
        """Called as the run begins, or goes on, at this sample."""

    def take(self, reading: Reading) -> None:
        """Take one instant's reading."""

    def miss(self, t: float, silent: Mask, current: Array) -> None:
        """Take an instant [s] at which no motion is known.

        Args:
            silent: joints whose angles are missing, (J,).
            current: [A], (J,); NaN: not measured.
        """

    def note(self, restarts: int, load_as_set: bool) -> None:
        """Take what no reading contains, before the run is kept or ends.

        Args:
            restarts: how often the belief was reset because it was no longer credible.
            load_as_set: whether the controller is set to the tracked load.
        """

    def keep(self, index: int) -> None:
        """Keep the observer's state: the run is about to be kept as of this sample."""

    def kept(self, wait: bool) -> bool:
        """Whether the state last asked for is kept; raises where it cannot be."""

    def finish(self) -> Mapping[str, Any]:
        """Called at the stream's end; returns additions to the run's summary."""

    def forget(self) -> None:
        """Drop what was kept: the run will not go on."""

    def close(self) -> None:
        """Called when the run is over or has failed."""

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """Findings so far, as in findings.json."""

    @property
    def doubt(self) -> str:
        """A reason to doubt all findings; "" where there is none."""
