"""A twin and a log, and what runs of them say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from urdyn.estimate import EKF
from urdyn.identify import Fit
from urdyn.tracking import Arrival, Source, Tracker, open_source, run
from urdyn.types import Log


@dataclass(frozen=True)
class Workshop:
    """A virtual arm's twin, and a recording."""

    fit: Fit
    log: Log
    twin: Path
    recording: Path

    def track(self, out: Path, source: Source | None = None, **options):
        """A run of the recording, or of another source, by the quickest filter."""
        source = source or open_source(str(self.recording))
        tracker = Tracker(self.fit, options.pop("filter", EKF()), source.period)
        return run(tracker, source, out, **options)


class KilledError(Exception):
    """What ends a run in these tests, wherever it is."""


def killed_at(source: Source, sample: int) -> Source:
    """The source, whose run dies before `sample`."""

    def start(first: int) -> Iterator[Arrival]:
        for index, arrival in enumerate(source.start(first), first):
            if index == sample:
                raise KilledError
            yield arrival

    return replace(source, start=start)


def rows(out: Path):
    """The history, without what says where it is from."""
    return pq.read_table(out / "history.parquet").replace_schema_metadata()


def assert_same(one: Path, other: Path) -> None:
    """The histories are equal to the last bit."""
    a, b = rows(one), rows(other)
    assert a.column_names == b.column_names
    for name in a.column_names:
        np.testing.assert_array_equal(a[name].to_numpy(), b[name].to_numpy(), name)
