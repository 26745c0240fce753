"""The history of the parameters, as a table that is written while it grows."""

from __future__ import annotations

import json
import os
from collections.abc import Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.io import writing
from urdyn.io.run_folder import HISTORY
from urdyn.tracking.output.history_parts import damaged, part_file
from urdyn.tracking.output.history_row import columns
from urdyn.types import Array

GROUP = 4096  # rows that are compressed together
FEW = 8  # parts that are joined at once: when a run is resumed, all of its parts are waiting


@dataclass(frozen=True)
class History:
    """The table of one run: in parts, and at its end in one file."""

    folder: Path
    names: tuple[str, ...]  # of quantities
    units: tuple[str, ...]
    joints: int

    def write(self, number: int, rows: Sequence[Array]) -> None:
        """Write some rows as a part's file, where others can read it during the run."""
        cells = [
            pa.array(column.astype(field.type.to_pandas_dtype()))
            for column, field in zip(np.array(rows).T, self._schema, strict=True)
        ]
        with writing(part_file(self.folder, number)) as stream:
            pq.write_table(pa.table(cells, schema=self._schema), stream, **self._compact)

    def joined(self, origin: Mapping[str, str]) -> Generator[None, int | None, None]:
        """Join the parts whose numbers are sent into DIR/history.parquet; None ends it.

        Its metadata hold `origin`. If the generator is closed instead, no file is left.
        """
        named = dict(zip(self.names, self.units, strict=True))
        about = {"urdyn.provenance": dict(origin), "urdyn.units": named}
        table = self._schema.with_metadata({key: json.dumps(value) for key, value in about.items()})
        with (
            writing(self.folder / HISTORY) as stream,
            pq.ParquetWriter(stream, table, **self._compact) as writer,
        ):
            waiting: list[pa.Table] = []
            while (number := (yield)) is not None:
                waiting.append(self._part(number).replace_schema_metadata(table.metadata))
                if sum(map(len, waiting)) >= GROUP:
                    _flush(writer, waiting)
            _flush(writer, waiting)

    def _part(self, number: int) -> pa.Table:
        path = part_file(self.folder, number)
        try:
            return _rows(path)
        except (pa.ArrowException, OSError) as error:
            raise damaged(path) from error

    def changes(self) -> list[float]:
        """Times at which the payload was taken to have changed [s], once all is joined."""
        table = _rows(self.folder / HISTORY, ["t", "widened"])
        # By NumPy: Arrow would load its compute kernels for this.
        t, widened = (table[name].to_numpy() for name in ("t", "widened"))
        return [float(moment) for moment in t[widened]]

    @cached_property
    def _schema(self) -> pa.Schema:
        types = {float: pa.float64(), int: pa.int64(), bool: pa.bool_()}
        return pa.schema(
            pa.field(name, types[kind], metadata={"unit": unit} if unit else None)
            for name, unit, kind in columns(self.names, self.units, self.joints)
        )

    @cached_property
    def _compact(self) -> dict[str, Any]:
        """Write options: bytes of equal significance side by side, since most do not change."""
        split = {f.name: "BYTE_STREAM_SPLIT" for f in self._schema if pa.types.is_floating(f.type)}
        return {"compression": "zstd", "use_dictionary": False, "column_encoding": split}


class Whole:
    """All parts of a history as one file, which grows as they are written."""

    def __init__(self, history: History, origin: Mapping[str, str]) -> None:
        self._file, self._next = history.joined(origin), 0  # the next part to append
        next(self._file)

    def approach(self, parts: int) -> None:
        """Append a few of the missing parts, up to `parts`: few, so that no one waits for long."""
        for number in range(self._next, min(self._next + FEW, parts)):
            self._file.send(number)
            self._next = number + 1

    def finish(self, parts: int) -> None:
        """Append all that are missing, and end the file."""
        while self._next < parts:
            self.approach(parts)
        with suppress(StopIteration):
            self._file.send(None)

    def close(self) -> None:
        """Discard the file, unless it is finished."""
        self._file.close()


def _rows(path: Path, names: list[str] | None = None) -> pa.Table:
    """The table in our file; `pq.read_table` would load a query engine and start threads."""
    # The name as bytes, which need not be valid text.
    with pa.OSFile(os.fsencode(path)) as stream, pq.ParquetFile(stream) as file:
        return file.read(names, use_threads=False)


def _flush(writer: pq.ParquetWriter, waiting: list[pa.Table]) -> None:
    """Write the waiting tables as one row group."""
    if waiting:
        writer.write_table(pa.concat_tables(waiting).combine_chunks())
    waiting.clear()
