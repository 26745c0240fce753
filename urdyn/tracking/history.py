"""Where the parameters went, as a table that is written while it grows."""

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
from urdyn.tracking.parts import damaged, part_file
from urdyn.tracking.row import columns
from urdyn.types import Array

GROUP = 4096  # rows that are compressed together
FEW = 8  # parts that are joined at once: of a run that is taken up again, all are there to join


@dataclass(frozen=True)
class History:
    """The table of one run: in parts, and at its end in one file."""

    folder: Path
    names: tuple[str, ...]  # of the quantities
    units: tuple[str, ...]
    joints: int

    def write(self, number: int, rows: Sequence[Array]) -> None:
        """Some rows as a part's file; whoever follows the run reads it there."""
        cells = [
            pa.array(column.astype(field.type.to_pandas_dtype()))
            for column, field in zip(np.array(rows).T, self._schema, strict=True)
        ]
        with writing(part_file(self.folder, number)) as stream:
            pq.write_table(pa.table(cells, schema=self._schema), stream, **self._compact)

    def joined(self, origin: Mapping[str, str]) -> Generator[None, int | None, None]:
        """One file, DIR/history.parquet, of the parts whose numbers are sent; None ends it.

        It says what it was made of. One that is closed instead was never there.
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
        # By NumPy: Arrow would load its kernels for it.
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
        """How a table is written: bytes of a kind side by side, for most stay as they were."""
        split = {f.name: "BYTE_STREAM_SPLIT" for f in self._schema if pa.types.is_floating(f.type)}
        return {"compression": "zstd", "use_dictionary": False, "column_encoding": split}


class Whole:
    """All parts of a history as one file, which grows beside them."""

    def __init__(self, history: History, origin: Mapping[str, str]) -> None:
        self._file, self._next = history.joined(origin), 0  # the part that it lacks
        next(self._file)

    def approach(self, parts: int) -> None:
        """A few parts on, where it lacks any of so many: nobody waits for long."""
        for number in range(self._next, min(self._next + FEW, parts)):
            self._file.send(number)
            self._next = number + 1

    def finish(self, parts: int) -> None:
        """It has all of them."""
        while self._next < parts:
            self.approach(parts)
        with suppress(StopIteration):
            self._file.send(None)

    def close(self) -> None:
        """It is not wanted, unless it is finished."""
        self._file.close()


def _rows(path: Path, names: list[str] | None = None) -> pa.Table:
    """What a file of ours holds; `pq.read_table` would load a query engine, and start threads."""
    # By the bytes of its name, which may be no text.
    with pa.OSFile(os.fsencode(path)) as stream, pq.ParquetFile(stream) as file:
        return file.read(names, use_threads=False)


def _flush(writer: pq.ParquetWriter, waiting: list[pa.Table]) -> None:
    """Write what waits as one group of rows."""
    if waiting:
        writer.write_table(pa.concat_tables(waiting).combine_chunks())
    waiting.clear()
