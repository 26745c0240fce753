"""A recording, read in a process of its own: python -m urdyn.tracking.sources.recording.

The tracking process loads no file readers, and holds only BLOCK samples of a log of any length. The
first request says what to read, and the answer describes the log; each further one names a first
row, and the answer is the block from there on, its columns side by side.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from urdyn.errors import InputError, LogError
from urdyn.io.effort import Effort
from urdyn.io.frames import Words, numbers_of, words_frame, words_of
from urdyn.io.helper import Helper
from urdyn.io.helping import Heard, helping
from urdyn.signal import BESIDE, POSE, SETTING, Sample, Touch, require_measured, samples, touch_of
from urdyn.signal.channels import IN_CONTACT, STATUS, has_velocities
from urdyn.signal.stretches import median_step
from urdyn.tracking.sources.source import CHANNELS, Arrival, Rows, Source
from urdyn.types import Array, Log
from urdyn.types import Source as LogSource

NEEDED = ("actual_q", "actual_current")
TOLD_BY = ("actual_q", BESIDE[POSE])  # channels that tell whose a log is
GLANCES = 300  # rows of those, evenly spaced
BLOCK = 2048  # samples: a few milliseconds to hand over, a second or two to track


def recording(
    names: Sequence[str],
    columns: str | None,
    rows: Rows | None,
    rate: float | None,
    duration: float | None,
    effort: Effort,
    beside: Collection[str],
    contact: Touch | None,
) -> Source:
    """Logs as one source; arguments as for `open_source`. LogError where one is not a log."""
    reader = Helper("urdyn.tracking.sources.recording", "the log's reader", "run again")
    asked = {
        "paths": names,
        "columns": columns,
        "rows": rows,
        "rate": rate,
        "duration": duration,
        "effort": {"unit": effort.unit, "gain": effort.gain},
        "beside": list(beside),
        "contact": str(contact or ""),
    }
    try:
        log = words_of(reader.ask(words_frame(asked)))
    except BaseException as error:
        reader.close()
        if isinstance(error, InputError):  # its message says where
            raise LogError(str(error)) from None
        raise
    widths = {key: int(width) for key, width in log["widths"].items()}

    def block(first: int) -> Iterator[Sample]:
        return samples(_parted(numbers_of(reader.ask(words_frame({"from": first}))), widths))

    def start(first: int) -> Iterator[Arrival]:
        every = chain.from_iterable(map(block, range(first, log["length"], BLOCK)))
        return map(Arrival, every)

    sent = frozenset(stream for stream, channel in BESIDE.items() if channel in widths)
    return Source(
        name=" ".join(names),
        identity=log["identity"],
        sha256=log["sha256"],
        period=log["period"],
        joints=log["joints"],
        live=False,
        length=log["length"],
        start=start,
        close=reader.close,
        defects=tuple(log["defects"]),
        velocities=log["velocities"],
        glimpse=_glimpsed(log["glimpse"], " ".join(names)),
        beside=sent,
    )


def _answers(heard: Heard) -> Iterator[Words | Array]:
    """A description of the log, then its blocks."""
    log, told = _opened(**words_of(next(heard)))
    yield told
    for words in map(words_of, heard):
        first = words["from"]
        yield _together(log.slice(first, first + BLOCK))


def _opened(
    paths: list[str],
    duration: float | None,
    effort: Mapping[str, Any],
    beside: Collection[str],
    contact: str,
    **how: Any,
) -> tuple[Log, dict[str, Any]]:
    """The log, and what the tracking process needs to know of it."""
    from urdyn.io import read

    told_by = touch_of(contact) if contact else None
    wanted = (*CHANNELS, *STATUS, IN_CONTACT, *SETTING, *(BESIDE[stream] for stream in beside))
    channels = (*wanted, *TOLD_BY, *([told_by.channel] if told_by else []))
    log = read(*paths, channels=channels, effort=Effort(**effort), **how)
    log = told_by.marked(log) if told_by else log
    glimpse = _glimpse(log)
    log = replace(log, channels={n: x for n, x in log.channels.items() if n in wanted})
    require_measured(log, ("actual_q",) if POSE in beside else NEEDED)
    if len(log) < 2:
        raise InputError(f"{log.source.path}: has {len(log)} samples; nothing can be tracked")
    until = log.t[0] + (np.inf if duration is None else duration)
    length = int(np.searchsorted(log.t, until))
    told = {
        "length": length,
        "widths": {name: values[0].size for name, values in log.channels.items()},
        "identity": f"{log.source.sha256} {log.source.rows} {how['columns']} {effort} {contact}",
        "sha256": log.source.sha256,
        "period": median_step(log.t),
        "velocities": has_velocities(log),
        "joints": log.joints,
        "defects": [str(defect) for defect in log.defects],
        "glimpse": glimpse,
    }
    return log.slice(0, length), told


def _glimpse(log: Log) -> dict[str, Array]:
    """A few rows, enough to tell whose log it is."""
    rows = np.linspace(0, max(len(log) - 1, 0), min(GLANCES, len(log))).astype(int)
    return {"t": log.t[rows]} | {n: log.channels[n][rows] for n in TOLD_BY if n in log}


def _glimpsed(rows: Mapping[str, Any], name: str) -> Log:
    """The inverse of `_glimpse`."""
    told = {what: np.array(values, dtype=np.float64) for what, values in rows.items()}
    return Log(told.pop("t"), told, LogSource(name))


def _together(log: Log) -> Array:
    """Stamps and channels side by side, (N, 1 + widths)."""
    return np.column_stack([log.t, *log.channels.values()])


def _parted(numbers: Array, widths: Mapping[str, int]) -> Log:
    """The inverse of `_together`."""
    table = numbers.reshape(-1, 1 + sum(widths.values()))
    parts = np.split(table[:, 1:], np.cumsum([*widths.values()])[:-1], axis=1)
    named = dict(zip(widths, parts, strict=True))
    scalars = {
        name: named[name][:, 0]
        for name, width in widths.items()
        if width == 1 and name not in CHANNELS
    }
    return Log(table[:, 0], named | scalars)


if __name__ == "__main__":
    helping(_answers)
