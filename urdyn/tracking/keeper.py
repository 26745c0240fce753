"""A run is put on disk beside its samples: none of them waits for a disk, or for an onlooker."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from urdyn.tracking import checkpoint
from urdyn.tracking.checkpoint import Checkpoint
from urdyn.tracking.history import History, Part
from urdyn.tracking.observer import Observer

S = TypeVar("S")


@dataclass(frozen=True, eq=False)
class _Asked(Generic[S]):
    """What is to be on disk soon: values that nobody changes any more."""

    at: Checkpoint[S]
    part: Part | None


class Keeper(Generic[S]):
    """Writes in the order that a killed run needs: rows and onlooker first, the checkpoint last."""

    def __init__(
        self, history: History, identity: Mapping[str, str], observer: Observer | None
    ) -> None:
        self._history, self._identity, self._observer = history, identity, observer
        self._asked: _Asked[S] | None = None
        self._written: Future[None] | None = None
        self._hand = ThreadPoolExecutor(1)

    def keep(self, at: Checkpoint[S]) -> Checkpoint[S]:
        """The run as it is now; it will be on disk a little later."""
        self.settle()
        part = self._history.cut()
        at = replace(at, parts=self._history.parts)
        if self._observer:
            self._observer.keep(at.index)
        self._asked = _Asked(at, part)
        self.go_on()
        return at

    def go_on(self, wait: bool = False) -> None:
        """Write what was asked for, once the observer has kept its own."""
        if self._asked and (not self._observer or self._observer.kept(wait)):
            self._written = self._hand.submit(self._write, self._asked)
            self._asked = None

    def settle(self) -> None:
        """All that was asked for is on disk; raises where it cannot be."""
        self.go_on(wait=True)
        if self._written:
            self._written.result()

    def close(self) -> None:
        """No more, however the run has ended; what is being written is written."""
        self._hand.shutdown()

    def _write(self, asked: _Asked[S]) -> None:
        if asked.part:
            self._history.write(asked.part)
        checkpoint.save(asked.at, self._identity, self._history.folder)
