"""What a recorder writes, so that the file can be read whenever the process is killed.

.csv and .csv.zst grow by whole rows, flushed; of the latter every flush is a zstd frame of its own.
.parquet cannot be read without its last bytes, and .mcap has no index: until `finish` the file
holds .csv.zst, which `read` knows by its content, whatever the suffix; then it is rewritten in its
form, all or nothing.
What the kernel had not yet put on the disk is lost when the power fails.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pyarrow import csv

from urdyn.errors import InputError
from urdyn.io.bags.forms import require
from urdyn.io.bags.outgoing import told
from urdyn.io.bags.write import write_mcap
from urdyn.io.files import alone, writing
from urdyn.io.names import layout, spread
from urdyn.io.rtde.recipe import Rows
from urdyn.types import Array

SUFFIXES = (".parquet", ".mcap", ".csv.zst", ".csv")
REWRITTEN = (".parquet", ".mcap")
GROUP = 1 << 24  # [bytes] of CSV that become one row group, about
PACKED = "CSV in zstd, which `urdyn` reads and `urdyn convert` rewrites"
KEPT = f"holds the recording as {PACKED}, for {{}} {{}}"
Column = NDArray[Any]


def batch(rows: Rows, marks: Mapping[str, Column]) -> pa.RecordBatch:
    """Packages, and our marks on each, as columns: `actual_q_0`, as recorders name them."""
    own = rows.dtype.newbyteorder("=")
    told = {name: rows[name].astype(own[name].base) for name in own.names or ()}
    columns = spread(told) | dict(marks)
    return pa.record_batch({name: pa.array(values) for name, values in columns.items()})


class Journal:
    """A recording as it grows."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if self.path.is_symlink():  # which stays
            self.path = Path(os.path.realpath(path))
        self._form = next((end for end in SUFFIXES if self.path.name.lower().endswith(end)), "")
        if not self._form:
            raise InputError(f"{self.path}: a recording is to end in {', '.join(SUFFIXES)}")
        if not self.path.parent.is_dir() or self.path.is_dir():
            raise InputError(f"{self.path}: cannot be written: there is no such place for a file")
        if self._form == ".mcap":  # now, not when an hour has been recorded
            require("mcap", "rosbags")
        self.aside: Path | None = None  # where the file's former content is now
        self._schema: pa.Schema | None = None
        self._stream: BinaryIO | None = None
        self._full = False  # could rows not be written?
        self._held = ExitStack()

    def write(self, rows: pa.RecordBatch) -> None:
        """Append rows, all of one recipe; they outlive this process from here on."""
        try:
            if self._stream is None:
                self._schema, self._stream = rows.schema, self._begun()
                self._append((",".join(rows.schema.names) + "\n").encode())
            text = pa.BufferOutputStream()
            csv.write_csv(rows, text, csv.WriteOptions(include_header=False))
            self._append(text.getvalue().to_pybytes())
        except OSError as error:
            self._full = True
            kept = "; what is in it is whole" if self._stream and self._stream.tell() else ""
            kept += f", as {PACKED}" if kept and self._form in REWRITTEN else ""
            raise InputError(f"{self.path}: cannot be written: {error.strerror}{kept}") from error

    def finish(self, metadata: Mapping[str, str]) -> None:
        """No more rows. Parquet and MCAP carry `metadata`; CSV has no place for it."""
        if self._stream is None:
            return
        with self._held:
            os.fsync(self._stream.fileno())
            empty = self._stream.tell() == 0
            self._stream.close()
            if empty:  # there was no room for a row
                self.path.unlink()
            elif self._form in REWRITTEN and not self._full:
                try:
                    self._rewrite(metadata)
                except InputError as error:
                    why = str(error).removeprefix(f"{self.path}: ")
                    raise InputError(f"{self.path}: {KEPT.format(self._form, why)}") from error

    def _begun(self) -> BinaryIO:
        """The empty file, ours alone; no recording can be made again, so none is overwritten."""
        self.path.touch()
        with alone(self.path):
            if self.path.stat().st_size:
                stem = self.path.name[: -len(self._form)]
                names = (f"{stem}.{k}{self._form}" for k in count(1))
                places = map(self.path.with_name, names)
                self.aside = next(place for place in places if not place.exists())
                self.path.rename(self.aside)
        stream = self.path.open("wb", buffering=0)
        self._held.enter_context(alone(self.path))
        return stream

    def _append(self, text: bytes) -> None:
        assert self._stream is not None, "the stream is open"
        packed = text if self._form == ".csv" else pa.compress(text, codec="zstd", asbytes=True)
        whole, rest = self._stream.tell(), memoryview(packed)
        try:
            while rest:
                rest = rest[self._stream.write(rest) :]
        except OSError:
            self._stream.truncate(whole)  # a torn frame would hide all before it
            self._stream.seek(whole)
            raise

    def _rewrite(self, metadata: Mapping[str, str]) -> None:
        """The journal as what it is to be, in its place."""
        assert self._schema is not None, "rows were written"
        options = csv.ConvertOptions(column_types=self._schema, null_values=[])  # NaN is a number
        # Arrow's own file, as `urdyn.io.sound` has its own memory: workers outlive the interpreter.
        with writing(self.path) as target, pa.OSFile(os.fsencode(self.path)) as stream:
            text = pa.CompressedInputStream(stream, "zstd")
            reader = csv.open_csv(text, csv.ReadOptions(block_size=GROUP), convert_options=options)
            if self._form == ".mcap":
                write_mcap(told(map(_channels, reader)), target, metadata)
            else:
                _write_parquet(reader, target, self._schema.with_metadata(dict(metadata)))


def _write_parquet(reader: Iterable[pa.RecordBatch], target: BinaryIO, schema: pa.Schema) -> None:
    with pq.ParquetWriter(target, schema, compression="zstd") as writer:
        for rows in reader:
            writer.write_batch(rows)


def _channels(rows: pa.RecordBatch) -> dict[str, Array]:
    """Rows of a journal as channels of a log."""
    columns = [np.asarray(column, dtype=np.float64) for column in rows.columns]
    return {
        name: columns[places]
        if isinstance(places, int)
        else np.stack([columns[place] for place in places], axis=1)
        for name, places in layout(rows.schema.names).items()
    }
