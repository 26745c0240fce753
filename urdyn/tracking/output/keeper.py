"""Writes a run to disk without delaying its samples: none waits for the disk or the observer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Generic

from urdyn.estimate.protocol import S
from urdyn.io.frames import Words, numbers_frame, words_frame, words_of
from urdyn.io.helper import Helper
from urdyn.tracking.belief.physical import Quantities
from urdyn.tracking.output import checkpoint
from urdyn.tracking.output.checkpoint import Checkpoint
from urdyn.tracking.output.observer import Observer
from urdyn.types import Array


def begin_scribe() -> Helper:
    """Start the writing process; started early, it is ready when the stream is."""
    return Helper("urdyn.tracking.output.scribe", "the history's scribe", "run again")


class Keeper(Generic[S]):
    """Has things written in the order that a killed run needs: rows, observer, checkpoint.

    The writing happens in another process, so that the tracking process needs no Arrow. While that
    process waits for a slow disk, rows wait in this one's memory: some 50 MB an hour.
    """

    def __init__(
        self,
        folder: Path,
        of: Quantities,
        identity: Mapping[str, str],
        origin: Mapping[str, str],
        observer: Observer | None,
        scribe: Helper,
    ) -> None:
        """`scribe` is ended by the code that began it, once the run has settled or failed.

        Args:
            identity: twin, source and settings that the checkpoints belong to.
            origin: provenance that the history records.
        """
        self._observer = observer
        self._asked: Checkpoint[S] | None = None  # waits for the observer
        self._fresh = False  # there are rows that are in no part yet
        self._keeping = self._kept = -1  # sample counts, asked for and written
        self._changes: list[float] | None = None
        self._scribe = scribe
        form = {"names": of.names, "units": of.units, "joints": of.currents.reference.arm.joints}
        whose = {"identity": dict(identity), "origin": dict(origin)}
        task = {"folder": str(folder.absolute()), **whose, **form}
        self._scribe.await_ready()
        self._scribe.send(words_frame(task))

    @property
    def settled(self) -> bool:
        """Whether all that was asked for is on disk, so that `keep` will not wait."""
        return self._asked is None and self._kept == self._keeping

    def take(self, row: Array) -> None:
        """Add one row to the history."""
        self._scribe.send(numbers_frame(row))
        self._fresh = True

    def keep(self, at: Checkpoint[S]) -> Checkpoint[S]:
        """Keep the run as it is now, once settled; it will be on disk a little later."""
        self.settle()
        if self._fresh:
            self._scribe.send(words_frame({"cut": at.parts}))
            at, self._fresh = replace(at, parts=at.parts + 1), False
        if self._observer:
            self._observer.keep(at.index)
        self._asked = at
        self.go_on()
        return at

    def go_on(self, wait: bool = False) -> None:
        """Have the checkpoint that was asked for written, once the observer has kept its own.

        Raises where either cannot be.
        """
        if self._asked and (not self._observer or self._observer.kept(wait)):
            layout, numbers = checkpoint.flattened(self._asked)
            self._keeping = self._asked.index
            words = {"keep": self._keeping, "layout": layout}
            self._scribe.send(words_frame(words), numbers_frame(numbers))
            self._asked = None
        elif self._kept != self._keeping or self._scribe.waiting:
            self._hear(self._scribe.listen(0.0))

    def settle(self) -> None:
        """Wait until all that was asked for is on disk; raises where it cannot be."""
        self.go_on(wait=True)
        while self._kept != self._keeping:
            self._hear(self._scribe.listen())

    def join(self, parts: int) -> list[float]:
        """Join the parts into one file; returns when the payload was taken to have changed [s]."""
        self._scribe.send(words_frame({"join": parts}))
        while self._changes is None:
            self._hear(self._scribe.listen())
        return self._changes

    def _hear(self, heard: list[Words | Array]) -> None:
        for words in map(words_of, heard):
            self._kept = words.get("kept", self._kept)
            self._changes = words.get("changes")
