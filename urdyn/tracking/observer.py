"""Those who look on at a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from urdyn.tracking.reading import Reading
from urdyn.types import Array, Mask


class Observer(Protocol):
    """One who looks on, and remembers where a run that is killed goes on."""

    def begin(self, folder: Path, index: int, identity: Mapping[str, str]) -> None:
        """The run begins, or goes on, at this sample."""

    def take(self, reading: Reading) -> None:
        """One instant on."""

    def miss(self, t: float, silent: Mask, current: Array) -> None:
        """An instant [s] at which no motion is known.

        Args:
            silent: joints whose angles were none, (J,).
            current: [A], (J,); NaN: not measured.
        """

    def note(self, restarts: int, load_as_set: bool) -> None:
        """What no instant tells, before the run is kept or ends.

        Args:
            restarts: how often the belief began anew, since no arm was believed in any more.
            load_as_set: the controller is set to the load that is tracked.
        """

    def keep(self, index: int) -> None:
        """The run is about to be kept as of this sample."""

    def kept(self, wait: bool) -> bool:
        """Whether what it was last asked to keep is kept; raises where it cannot be."""

    def finish(self) -> Mapping[str, Any]:
        """The stream has ended: what there is to say, for the run's summary."""

    def forget(self) -> None:
        """The run will not go on."""

    def close(self) -> None:
        """The run is over, or has failed: no more."""

    @property
    def findings(self) -> tuple[Mapping[str, Any], ...]:
        """What was found so far, as in findings.json."""

    @property
    def doubt(self) -> str:
        """What speaks against all of that; "" where nothing does."""
