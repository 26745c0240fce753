"""Parquet recordings -> tables: columns named as in RTDE's CSV, or lists of one value a joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.io.dialect import Dialect, Kind
from urdyn.io.names import duplicates, rename
from urdyn.io.plan import Plan
from urdyn.io.sound import blanks, numbers
from urdyn.io.table import Table

MAGIC = b"PAR1"
BATCH = 1 << 17  # rows that memory holds twice


def described(file: pq.ParquetFile, path: str) -> Dialect:
    """The file's columns as fields; a list of k values is k fields, `name_0` and so on."""
    if file.metadata.num_rows == 0:
        raise LogError("has no data", path)
    start = next(file.iter_batches(1))
    columns: list[str] = []
    kinds: list[Kind] = []
    for name, column in zip(start.schema.names, start.columns, strict=True):
        names, kind = _fields(rename(name), column)
        columns += names
        kinds += [kind] * len(names)
    if twice := duplicates(columns):
        raise LogError(f"two columns are called {twice[0]}", path)
    return Dialect("", ".", tuple(columns), tuple(kinds), len(columns))


def _fields(name: str, column: pa.Array) -> tuple[list[str], Kind]:
    """Names of the fields that a column holds, and what their cells are."""
    listed = _is_list(column.type)
    of = column.type.value_type if listed else column.type
    kind = Kind.NUMBER if _is_number(of) else Kind.TEXT
    width = len(column.flatten()) if listed else 0
    return [f"{name}_{k}" for k in range(width)] if listed else [name], kind


def tables(file: pq.ParquetFile, plan: Plan, path: str) -> Iterator[Table]:
    """The wanted rows, a table a batch."""
    row = 0
    for batch in file.iter_batches(BATCH):
        first, stop = (int(min(max(b - row, 0), len(batch))) for b in (plan.start, plan.stop))
        part = batch.slice(first, max(stop - first, 0))
        rows = np.arange(row + first, row + first + len(part))
        row += len(batch)
        fields = [field for column in part.columns for field in _split(column, path)]
        if len(fields) != len(plan.dialect.columns) and len(part):
            raise LogError("has lists of more than one length", path)
        values = np.empty((len(part), len(plan.places)), order="F")
        empty = np.zeros_like(values, dtype=bool)
        for k, place in enumerate(plan.places if len(part) else []):
            values[:, k] = numbers(fields[place])
            empty[:, k] = fields[place].is_null().to_numpy(zero_copy_only=False)
        line = np.zeros(len(part), dtype=np.intp)
        yield plan.table(values, line, rows, blanks(values, empty, line), row)


def _split(column: pa.Array, path: str) -> list[pa.Array]:
    """The fields of a column: itself, or one for every place of its lists."""
    if not _is_list(column.type) or not len(column):
        return [column]
    cells = column.flatten()
    width, rest = divmod(len(cells), len(column))
    if rest or column.null_count:
        raise LogError("has lists of more than one length", path)
    return [cells.take(pa.array(np.arange(k, len(cells), width))) for k in range(width)]


def _is_list(of: pa.DataType) -> bool:
    return bool(
        pa.types.is_list(of) or pa.types.is_large_list(of) or pa.types.is_fixed_size_list(of)
    )


def _is_number(of: pa.DataType) -> bool:
    kinds = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_timestamp)
    return any(kind(of) for kind in kinds) or bool(pa.types.is_decimal(of))
