"""write(): Log -> CSV as ur_rtde's recorder writes it, or Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv as arrow_csv

from urdyn.errors import InputError
from urdyn.io.compression import WRITERS
from urdyn.io.files import writing
from urdyn.types import Array, Log
from urdyn.version import __version__

BATCH = 1 << 16  # rows that memory holds twice


def write(log: Log, path: str | Path) -> None:
    """Write a log so that reading it gives the same numbers; the suffix of `path` says how.

    .csv (.csv.gz .csv.bz2 .csv.xz .csv.zst) or .parquet, which also carries where the log is from.
    """
    suffixes = [suffix.lower() for suffix in Path(path).suffixes]
    packed = WRITERS.get(suffixes[-1]) if suffixes else None
    form = suffixes[-1 - bool(packed)] if len(suffixes) > bool(packed) else ""
    if form not in (".csv", ".parquet") or (packed and form == ".parquet"):
        raise InputError(f"{path}: is to end in .csv or .parquet, or .csv.gz, .csv.zst, ...")
    with writing(path) as stream:
        if form == ".parquet":
            _write_parquet(log, stream)
        elif packed:
            with packed(stream) as archive:
                _write_csv(log, archive)
        else:
            _write_csv(log, stream)


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
    """With the version that wrote it, and the file that the numbers are from."""
    origin = {
        "urdyn.version": __version__,
        "urdyn.source.path": log.source.path,
        "urdyn.source.sha256": log.source.sha256,
    }
    schema = _schema(log).with_metadata(origin)
    with pq.ParquetWriter(stream, schema, compression="zstd") as writer:
        for batch in _batches(log, schema):
            writer.write_batch(batch)


def _columns(log: Log) -> dict[str, Array]:
    """RTDE column -> values, (N,): the stamps, then every channel, a vector one column a place."""
    columns = {"timestamp": log.t}
    for name, values in log.channels.items():
        if values.ndim == 1:
            columns[name] = values
        else:
            columns |= {f"{name}_{k}": values[:, k] for k in range(values.shape[1])}
    return columns


def _schema(log: Log) -> pa.Schema:
    return pa.schema([(name, pa.float64()) for name in _columns(log)])


def _batches(log: Log, schema: pa.Schema) -> Iterator[pa.RecordBatch]:
    """The columns a stretch of rows at a time."""
    columns = list(_columns(log).values())
    for start in range(0, len(log), BATCH):
        cells = [pa.array(values[start : start + BATCH]) for values in columns]
        yield pa.record_batch(cells, schema=schema)
