"""write(): Log -> CSV as ur_rtde's recorder writes it, Parquet, MCAP, or a ROS 2 bag."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv as arrow_csv

from urdyn.errors import InputError
from urdyn.io.bags.outgoing import told
from urdyn.io.bags.write import write_db3, write_mcap
from urdyn.io.compression import WRITERS
from urdyn.io.files import place, writing
from urdyn.io.names import spread
from urdyn.types import Array, Log
from urdyn.version import __version__

BATCH = 1 << 16  # rows that memory holds twice
FORMS = (".csv", ".parquet", ".mcap", ".db3", "")


def write(log: Log, path: str | Path) -> None:
    """Write a log so that reading it gives the same numbers; the suffix of `path` says how.

    .csv (.csv.gz .csv.bz2 .csv.xz .csv.zst), .parquet and .mcap, which also carry where the log is
    from, .db3; a name without a suffix is the folder of a ROS 2 bag. `read` judges what is written
    like any recording: fewer than two rows are no log, values at a repeated stamp are
    left out, an infinite one is NaN, and a lone `x_0` is the channel `x`.
    """
    form, packed = _form(place(path))
    if form in (".db3", ""):
        write_db3(told(_stretches(log)), Path(path))
        return
    with writing(path) as stream:
        if form == ".parquet":
            _write_parquet(log, stream)
        elif form == ".mcap":
            write_mcap(told(_stretches(log)), stream, origin(log))
        elif packed:
            with packed(stream) as archive:
                _write_csv(log, archive)
        else:
            _write_csv(log, stream)


def _form(path: Path) -> tuple[str, Callable[[BinaryIO], Any] | None]:
    """Suffix of the format, and its compressor; InputError where it is unknown."""
    suffixes = [suffix.lower() for suffix in path.suffixes]
    packed = WRITERS.get(suffixes[-1]) if suffixes else None
    form = suffixes[-1 - bool(packed)] if len(suffixes) > bool(packed) else ""
    if form not in FORMS or (packed and form != ".csv"):
        raise InputError(
            f"{path}: is to end in .csv or .parquet, .mcap, .db3, or .csv.gz, .csv.zst, ...; "
            "without any ending it is the folder of a ROS 2 bag"
        )
    return form, packed


def _stretches(log: Log) -> Iterator[dict[str, Array]]:
    """The log as channels with their stamps, a stretch of rows at a time."""
    for start in range(0, len(log), BATCH):
        part = log.slice(start, start + BATCH)
        yield {"timestamp": part.t} | dict(part.channels)


def origin(log: Log) -> dict[str, str]:
    """The version that wrote it, and the file of its numbers, as far as its name is text."""
    return {
        "urdyn.version": __version__,
        "urdyn.source.path": log.source.path.encode(errors="replace").decode(),
        "urdyn.source.sha256": log.source.sha256,
    }


def _write_csv(log: Log, stream: BinaryIO) -> None:
    """Numbers in the fewest digits that read back exactly."""
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(_columns(log))
    stream.write(header.getvalue().encode())
    options = arrow_csv.WriteOptions(include_header=False)
    for batch in _batches(log, _schema(log)):
        arrow_csv.write_csv(batch, buffer := pa.BufferOutputStream(), options)
        stream.write(buffer.getvalue().to_pybytes())


def _write_parquet(log: Log, stream: BinaryIO) -> None:
    """With its origin as metadata."""
    schema = _schema(log).with_metadata(origin(log))
    with pq.ParquetWriter(stream, schema, compression="zstd") as writer:
        for batch in _batches(log, schema):
            writer.write_batch(batch)


def _columns(log: Log) -> dict[str, Array]:
    """RTDE column -> values, (N,): the stamps, then every channel."""
    return spread({"timestamp": log.t} | dict(log.channels))


def _schema(log: Log) -> pa.Schema:
    return pa.schema([(name, pa.float64()) for name in _columns(log)])


def _batches(log: Log, schema: pa.Schema) -> Iterator[pa.RecordBatch]:
    """The columns a stretch of rows at a time."""
    columns = list(_columns(log).values())
    for start in range(0, len(log), BATCH):
        cells = [pa.array(values[start : start + BATCH]) for values in columns]
        yield pa.record_batch(cells, schema=schema)
