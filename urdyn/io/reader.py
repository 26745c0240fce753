"""read(): any recording -> Log, by what is in the file."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.io import bags, parquet
from urdyn.io.blocks import blocks
from urdyn.io.compression import TORN, HashedFile, Unpacked, decompressed
from urdyn.io.dialect import Dialect, sniff
from urdyn.io.effort import UNTOLD, Effort
from urdyn.io.files import place, sha256
from urdyn.io.mend import mend
from urdyn.io.names import CLOCKS, SIX_WIDE, layout, listed, some
from urdyn.io.parse import parse
from urdyn.io.plan import Plan
from urdyn.io.table import AS_NAN, Table, join, merge
from urdyn.io.twice import refuse_alike, refuse_twice
from urdyn.types import Defect, Log, Source

NAMED = "; name its columns from left to right by --columns"
UNREAD = "time stamps as text"
LEGIBLE = "make them seconds, or instants: 2026-11-29T12:00:01.010 in text, Parquet's timestamps"
PLANNED = {"timestamp", "q0", "v0", "a0"}  # columns that no recorder writes

Rows = tuple[int | None, int | None]


def read(
    path: str | Path,
    *more: str | Path,  # recordings that follow it, in the order of time
    columns: str | None = None,  # of a file without a header: "timestamp,actual_q*6,-"
    rows: Rows | None = None,  # half-open slice of the file's data rows, lost ones counted
    rate: float | None = None,  # [Hz] of a file without time stamps
    channels: Collection[str] | None = None,  # the only ones to keep; None: all
    effort: Effort = UNTOLD,  # what a bag's efforts are, and how torques become currents
) -> Log:
    """The recording in `path`: RTDE names, SI units, and whatever was amiss in `defects`.

    CSV as RTDE clients write it, `;` with decimal commas, Parquet; plain, gzip, bzip2, xz, zstd;
    bags of ROS 1 and ROS 2, MCAP. LogError where the file is no log, with its line. Where `more`
    follow, stamps that begin anew count on as those of a controller that restarted.
    """
    if more and rows:
        raise LogError(f"is one of {1 + len(more)} logs; --rows takes a slice of one", path)
    tables, sources = [], []
    for one in (path, *more):
        table, source = read_table(one, columns=columns, rows=rows, channels=channels)
        table = replace(table, channels=effort.amperes(table.channels, source.path))
        tables.append(_timed(table, rate, source))
        sources.append(source)
        if other := tables[0].channels.keys() ^ table.channels.keys():
            raise LogError(f"differs from {path} in columns: {', '.join(sorted(other))}", one)
    log = mend(*_together(tables, sources))
    unasked = set() if channels is None else CLOCKS - {*channels}
    return replace(log, channels={n: x for n, x in log.channels.items() if n not in unasked})


def _together(tables: list[Table], sources: list[Source]) -> tuple[Table, Source]:
    """Several files as one, with their names and hashes; LogError where rows would count twice."""
    if len(tables) == 1:
        return tables[0], sources[0]
    refuse_twice(sources)
    log = np.repeat(np.arange(len(tables)), [len(table) for table in tables])
    table = join(tables)
    refuse_alike(table, log, sources)
    return table, Source(" ".join(s.path for s in sources), " ".join(s.sha256 for s in sources))


def read_table(
    path: str | Path,
    *,
    columns: str | None = None,
    rows: Rows | None = None,
    channels: Collection[str] | None = None,
) -> tuple[Table, Source]:
    """The numbers in `path`, not mended: for poses, which no clock orders."""
    bounds = _bounds(rows, str(path))
    try:
        if bags.is_bag(place(path)):
            return _bag(Path(path), columns, rows, channels)
        with Path(path).open("rb") as stream:
            is_parquet = stream.read(len(parquet.MAGIC)) == parquet.MAGIC
            stream.seek(0)
            file = HashedFile(stream)
            unpacked = decompressed(file)
            if is_parquet:
                _refuse(columns, "Parquet", path)
                pieces = list(_parquet(str(path), bounds, channels))
            else:
                pieces = list(_text(unpacked, str(path), columns, bounds, channels))
            source = Source(str(path), file.sha256())
    except TORN as error:
        told = " ".join(str(error).split())  # Arrow's message has several lines
        reason = getattr(error, "strerror", None) or f"damaged file ({told})"
        raise LogError(f"cannot be read: {reason}", path) from error
    if not pieces:
        raise LogError("has no data", path)
    table = join(pieces)
    if unpacked.torn:
        line = int(table.line.max(initial=0)) + 1
        torn = Defect("torn archive", 1, line, "what follows is lost")
        table = replace(table, defects=merge((*table.defects, torn)))
    return table, source if rows is None else replace(source, rows=_cut(rows, table.rows, path))


def _bag(
    path: Path, columns: str | None, rows: Rows | None, channels: Collection[str] | None
) -> tuple[Table, Source]:
    """The wanted rows of a bag, whose data rows are the arm's joint states."""
    _refuse(columns, "a bag", path)
    table, source = bags.read_bag(path, channels), Source(str(path), sha256(path))
    if not len(table):
        raise LogError("has no data", path)
    if not table.channels.keys() - CLOCKS:
        raise LogError(f"has {_none_of(channels)}", path)
    if rows is None:
        return table, source
    cut = _cut(rows, table.rows, path)
    wanted = (table.row >= cut[0]) & (table.row < cut[1])
    return table.take(wanted), replace(source, rows=cut)


def _refuse(columns: str | None, kind: str, path: str | Path) -> None:
    """LogError where `columns` are given for a file that names its own."""
    if columns is not None:
        raise LogError(f"is {kind}, which names its own columns; leave out --columns", path)


def _cut(rows: Rows, count: int, path: str | Path) -> tuple[int, int]:
    """First and stop of `rows` in a file of `count` data rows; LogError where it lacks them."""
    first, stop = rows[0] or 0, count if rows[1] is None else rows[1]
    if not first < stop <= count:
        asked = f"{first}:{'' if rows[1] is None else stop}"
        raise LogError(f"has {count} data rows, --rows {asked} asks for others", path)
    return first, stop


def _text(
    file: Unpacked,
    path: str,
    columns: str | None,
    bounds: tuple[int, float],
    channels: Collection[str] | None,
) -> Iterator[Table]:
    """Tables of a text file; the first also carries what is amiss with its columns."""
    parts = blocks(file, path)
    start = next(parts, None)
    if start is None:
        raise LogError("is empty", path)
    dialect = sniff(start.data, columns, path)
    plan = _plan(dialect, bounds, channels, path)
    yield from _reported(parse(chain([start.below(dialect.line)], parts), plan), plan)


def _parquet(
    path: str, bounds: tuple[int, float], channels: Collection[str] | None
) -> Iterator[Table]:
    """Tables of a Parquet file."""
    with (
        pa.OSFile(os.fsencode(path)) as stream,  # whose name may not be valid text
        pq.ParquetFile(stream, pre_buffer=False) as file,  # else memory holds the whole file
    ):
        plan = _plan(parquet.described(file, path), bounds, channels, path)
        yield from _reported(parquet.tables(file, plan, path), plan)


def _bounds(rows: Rows | None, path: str) -> tuple[int, float]:
    """First and stop of the data rows that are wanted."""
    start, stop = rows or (None, None)
    bounds = 0 if start is None else start, np.inf if stop is None else stop
    if not 0 <= bounds[0] < bounds[1]:
        raise LogError(f"--rows {start}:{stop} is empty; write first:stop, from 0", path)
    return bounds


def _plan(
    dialect: Dialect, bounds: tuple[int, float], channels: Collection[str] | None, path: str
) -> Plan:
    """What is to be read; LogError if that is nothing."""
    plan = Plan(dialect, layout(dialect.numeric, channels), *bounds)
    if not plan.layout.keys() - CLOCKS:
        if {*layout(dialect.numeric)} >= PLANNED:
            told = "is a plan, as `urdyn excite` writes it, not a recording: record the robot that"
            raise LogError(f"{told} follows it", path, dialect.line)
        held = layout(dialect.numeric)
        there = some(held) or "no numbers at all"
        hint = "" if not held or any(map(SIX_WIDE.fullmatch, held)) else NAMED
        told = f"has {_none_of(channels)}; it has {there}{hint}"
        raise LogError(told, path, dialect.line)
    return plan


def _none_of(channels: Collection[str] | None) -> str:
    """Words for the wanted channels, none of which is there; one may be named twice."""
    wanted = tuple(dict.fromkeys(channels or ("channel",)))
    return f"{'no' if len(wanted) == 1 else 'none of'} {', '.join(wanted)}"


def _reported(tables: Iterator[Table], plan: Plan) -> Iterator[Table]:
    """The tables; the first lists columns of text and missing columns among its defects."""
    dialect = plan.dialect
    text, line = dialect.text, dialect.line
    stamp = dict(zip(dialect.columns, dialect.sample, strict=False)).get("timestamp", "")
    missing = sum(listed(places).count(-1) for places in plan.layout.values())
    defects: tuple[Defect, ...] = (
        Defect("text column", len(text), line, f"kept out: {', '.join(text)}"),
        Defect(UNREAD, text.count("timestamp"), line, f"such as {stamp}"),
        Defect("missing column", missing, line, AS_NAN),
    )
    for table in tables:
        yield replace(table, defects=(*merge(defects), *table.defects))
        defects = ()


def _timed(table: Table, rate: float | None, source: Source) -> Table:
    """The table with stamps [s]: its own, or row/rate, where a lost row keeps its place."""
    if "timestamp" in table.channels:
        if rate is not None:
            raise LogError("has time stamps of its own; leave out --rate", source.path)
        return table
    if rate is None:
        odd = next((defect.remedy for defect in table.defects if defect.kind == UNREAD), "")
        lacking = "has no column of time stamps; say the --rate in Hz"
        raise LogError(f"has {UNREAD}, {odd}; {LEGIBLE}" if odd else lacking, source.path)
    if not 0 < rate < np.inf:
        raise LogError(f"--rate {rate} is not a rate in Hz", source.path)
    table.channels["timestamp"] = table.row / rate
    return table
