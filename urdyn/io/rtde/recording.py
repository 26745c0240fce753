"""Events of a client -> rows of a journal, counted."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from datetime import UTC, datetime
from itertools import groupby
from typing import Any

import numpy as np

from urdyn.errors import RtdeError
from urdyn.io.rtde.client import Connected, Dropped, Event
from urdyn.io.rtde.events import Text
from urdyn.io.rtde.handshake import Agreement
from urdyn.io.rtde.journal import Journal, batch
from urdyn.io.rtde.link import Package
from urdyn.io.rtde.tally import Summary, Tally
from urdyn.version import __version__


class Recording:
    """Three columns are ours, beside those of the recipe:

    `received` [s] since 1970, by this computer's clock as it was at the beginning; `connection` 0,
    1, ..., one more after every reconnect; `skipped`, packages missing since the row before.
    """

    def __init__(self, journal: Journal, address: str, duration: float | None) -> None:
        self.journal, self.address = journal, address
        self.over = False  # all that was asked for is recorded
        self._duration = np.inf if duration is None else duration
        self._tally = Tally()
        self._agreement: Agreement | None = None
        self._started = datetime.now(UTC)
        self._ahead = self._started.timestamp() - time.monotonic()  # [s] of the monotonic clock
        self._notes: list[dict[str, Any]] = []  # drops and messages, with the row they came before

    def take(self, events: Iterable[Event]) -> None:
        """Write what came."""
        for packages, run in groupby(events, lambda event: isinstance(event, Package)):
            if packages:
                self._write([event for event in run if isinstance(event, Package)])
                continue
            for event in run:
                self._note(event)

    def summary(self) -> Summary:
        """The counts so far."""
        counts = self._tally.summary(str(self.journal.path), time.monotonic())
        return replace(
            counts,
            frequency=self._agreement.frequency if self._agreement else 0.0,
            left_out=self._agreement.left_out if self._agreement else (),
            aside=str(self.journal.aside or ""),
        )

    def finish(self) -> Summary:
        """Close the file, with an account of the recording."""
        summary = self.summary()
        self.journal.finish(dict(self._metadata(summary)))
        return summary

    def _note(self, event: Event) -> None:
        if isinstance(event, Connected):
            self._agree(event.agreement)
        elif isinstance(event, Dropped):
            self._tally.drop(event.torn)
            self._notes.append({"row": self._tally.samples, "dropped": event.reason})
        elif isinstance(event, Text):
            self._notes.append({"row": self._tally.samples, "message": event.message})

    def _agree(self, agreement: Agreement) -> None:
        known = self._agreement
        if known and known.recipe.dtype != agreement.recipe.dtype:
            raise RtdeError("has come back with other variables; record again", self.address)
        self._agreement = agreement
        self._tally.connect()

    def _write(self, packages: list[Package]) -> None:
        assert self._agreement is not None, "a client says first what it agreed on"
        received = np.array([package.received for package in packages])
        begin = self._tally.first if self._tally.samples else received[0]
        count = int(np.searchsorted(received, begin + self._duration))
        self.over = count < len(packages)
        if not count:
            return
        values = b"".join(package.values for package in packages[:count])
        rows, received = self._agreement.recipe.rows(values), received[:count]
        stamps = rows["timestamp"].astype(np.float64)
        skipped = self._tally.take(stamps, received, self._agreement.period)
        self._tally.bytes += len(values)
        marks = {
            "received": received + self._ahead,
            "connection": np.full(count, self._tally.connections - 1),
            "skipped": skipped.astype(np.int64),
        }
        self.journal.write(batch(rows, marks))

    def _metadata(self, summary: Summary) -> Iterator[tuple[str, str]]:
        """What Parquet keeps beside the columns."""
        yield "urdyn.version", __version__
        if self._agreement:
            agreed = {
                "address": self.address,
                "started": self._started.isoformat(),
                "controller": ".".join(map(str, self._agreement.release)),
                "protocol": self._agreement.version,
            }
            yield "urdyn.recording", json.dumps(agreed | asdict(summary) | {"notes": self._notes})
