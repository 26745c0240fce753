"""A twin and a log, and what runs of them say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from once import fitted

from urdyn.estimate import EKF
from urdyn.identify import Fit, identify
from urdyn.model.arm import load_arm
from urdyn.signal import condition
from urdyn.simulate import fourier, observe, parse_fault, typical_sensors, virtual_arm
from urdyn.tracking import Arrival, Source, Tracker, open_source, run
from urdyn.types import Log


@dataclass(frozen=True)
class Workshop:
    """A virtual arm's twin, and a recording."""

    fit: Fit
    log: Log
    twin: Path
    recording: Path

    @cached_property
    def source(self) -> Source:
        """The recording, opened once: its reader, a process, takes longer to begin than to read."""
        return open_source(str(self.recording))

    def track(self, out: Path, source: Source | None = None, **options):
        """A run of the recording, or of another source, by the quickest filter."""
        source = source or self.source
        filter_, network = options.pop("filter", EKF()), options.pop("network", None)
        tracker = Tracker(self.fit, filter_, source.period, network=network)
        return run(tracker, source, out, **options)


RATE = 100.0  # [Hz]


@lru_cache
def commissioned(seed):
    """A virtual arm, and what identification made of a first run."""
    arm = load_arm("ur10e")
    dynamics = virtual_arm(arm, seed)
    motion = condition(at_work(dynamics, seed, 0, 25.0))
    make = partial(identify, arm, motion, gain=dynamics.drive.gain)
    return dynamics, fitted(f"commissioned_{seed}", make)


def at_work(dynamics, seed, number, duration, *faults, rate=RATE):
    """The log of an arm's `number`-th run."""
    streams = [np.random.default_rng([seed, number, k]) for k in range(2)]
    asked = fourier(dynamics.arm, duration, rate, streams[0])
    events = [parse_fault(fault, 6) for fault in faults]
    return observe(dynamics, asked, typical_sensors(dynamics.arm), streams[1], events)


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
