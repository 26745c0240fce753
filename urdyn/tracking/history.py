"""Where the parameters went, as a table that is written while it grows."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.errors import InputError
from urdyn.io import writing
from urdyn.tracking.physical import Quantities
from urdyn.tracking.tracker import Reading
from urdyn.types import Array

FILE, PARTS = "history.parquet", "history.parts"
GROUP = 4096  # rows that are compressed together
FINE = 128.0  # steps in a standard deviation, and in an sd itself: what is finer is not known
FINEST = 2.0**-12  # [A] of a current


def schema(quantities: Quantities) -> pa.Schema:
    """t; every quantity's mean and sd; currents of every joint; surprise.

    Numbers are kept as finely as they are known, see `_rounded`: a day is some 70 MB.
    """
    joints = range(quantities.currents.reference.arm.joints)
    units = dict(zip(quantities.names, quantities.units, strict=True))
    pairs = [(f"{name}{what}", unit) for name, unit in units.items() for what in ("", ".sd")]
    pairs += [(f"{what}_{joint}", "A") for what in ("current", "predicted") for joint in joints]
    fields = [("t", "s"), *pairs, ("nis", "-")]
    columns = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in fields]
    return pa.schema([*columns, ("measured", pa.int64()), ("widened", pa.bool_())])


@dataclass(frozen=True, eq=False)
class Part:
    """Rows that are written together."""

    number: int
    rows: list[Array]


class History:
    """Rows of one run: those of whole parts are in files, the newest wait in memory."""

    def __init__(self, folder: Path, quantities: Quantities, parts: int = 0) -> None:
        self.folder, self.quantities = folder, quantities
        self.parts = parts  # that are cut
        self._schema = schema(quantities)
        self._rows: list[Array] = []

    def open(self) -> None:
        """A folder of the parts that count; what a killed run left beyond them is dropped."""
        parts = self.folder / PARTS
        parts.mkdir(parents=True, exist_ok=True)
        counted = {path.name for path in self._files()}
        for path in parts.iterdir():
            if path.name not in counted:
                path.unlink()
        if missing := counted - {path.name for path in parts.iterdir()}:
            raise InputError(f"{parts}: lacks {min(missing)}; start anew with --fresh")

    def take(self, reading: Reading, mean: Array, sd: Array) -> None:
        """One row on."""
        told = np.stack([_rounded(mean, sd / FINE), _rounded(sd, sd / FINE)], axis=1).ravel()
        currents = _rounded(np.concatenate([reading.current, reading.predicted]), FINEST)
        surprise = reading.innovation
        end = [surprise.nis, surprise.measured, reading.widened]
        row = np.array([reading.t]), told, currents, np.array(end)
        self._rows.append(np.concatenate(row))

    def cut(self) -> Part | None:
        """The rows that wait, as the next part, to be written; None where there are none."""
        if not self._rows:
            return None
        part = Part(self.parts, self._rows)
        self.parts, self._rows = self.parts + 1, []
        return part

    def write(self, part: Part) -> None:
        """A part as its file; whoever follows the run reads it there."""
        cells = [
            pa.array(column.astype(field.type.to_pandas_dtype()))
            for column, field in zip(np.array(part.rows).T, self._schema, strict=True)
        ]
        with writing(self.folder / PARTS / _name(part.number)) as stream:
            pq.write_table(pa.table(cells, schema=self._schema), stream, **self._compact)

    def join(self, origin: Mapping[str, str]) -> Path:
        """All parts as one file, DIR/history.parquet, that says what it was made of."""
        path, units = self.folder / FILE, self.quantities.units
        named = dict(zip(self.quantities.names, units, strict=True))
        told = {"urdyn.provenance": dict(origin), "urdyn.units": named}
        table = self._schema.with_metadata({key: json.dumps(value) for key, value in told.items()})
        with writing(path) as stream, pq.ParquetWriter(stream, table, **self._compact) as writer:
            waiting: list[pa.Table] = []
            for part in self._files():
                waiting.append(_rows(part).replace_schema_metadata(table.metadata))
                if sum(map(len, waiting)) >= GROUP:
                    _flush(writer, waiting)
            _flush(writer, waiting)
        return path

    @property
    def _compact(self) -> dict[str, Any]:
        """How a table is written: bytes of a kind side by side, for most stay as they were."""
        split = {f.name: "BYTE_STREAM_SPLIT" for f in self._schema if pa.types.is_floating(f.type)}
        return {"compression": "zstd", "use_dictionary": False, "column_encoding": split}

    def discard(self) -> None:
        """The parts, once they are joined for good."""
        shutil.rmtree(self.folder / PARTS)

    def _files(self) -> list[Path]:
        return [self.folder / PARTS / _name(k) for k in range(self.parts)]


def changes(path: Path) -> list[float]:
    """Times at which the payload was taken to have changed [s], of a history."""
    table = _rows(path, ["t", "widened"])  # by NumPy: Arrow would load its kernels for it
    t, widened = (table[name].to_numpy() for name in ("t", "widened"))
    return [float(moment) for moment in t[widened]]


def _rounded(values: Array, step: Array | float) -> Array:
    """To multiples of the power of two below `step`: a tenth of the bytes, once compressed."""
    grid = np.exp2(np.floor(np.log2(np.where(step > 0.0, step, 1.0))))
    return np.where(step > 0.0, np.round(values / grid) * grid, values)


def _rows(path: Path, columns: list[str] | None = None) -> pa.Table:
    """What a file of ours holds; `pq.read_table` would load a query engine, and start threads."""
    with pq.ParquetFile(path) as file:
        return file.read(columns, use_threads=False)


def _name(part: int) -> str:
    return f"part-{part:06d}.parquet"


def _flush(writer: pq.ParquetWriter, waiting: list[pa.Table]) -> None:
    """Write what waits as one group of rows."""
    tables: Sequence[pa.Table] = waiting
    if tables:
        writer.write_table(pa.concat_tables(tables).combine_chunks())
    waiting.clear()
