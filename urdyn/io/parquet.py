"""Parquet recordings -> tables: columns named as in RTDE's CSV, or lists of one value per joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from urdyn.errors import LogError
from urdyn.io.dialect import Dialect, Kind
from urdyn.io.names import duplicates, rename
from urdyn.io.plan import Plan
from urdyn.io.sound import blanks, numbers
from urdyn.io.table import Table

MAGIC = b"PAR1"
BATCH = 1 << 16  # rows that memory holds twice
LOOK = 1 << 10  # rows at a time in which a list with values is looked for
LISTS = (pa.types.is_list, pa.types.is_large_list, pa.types.is_fixed_size_list)
NUMBERS = (
    pa.types.is_integer,
    pa.types.is_floating,
    pa.types.is_boolean,
    pa.types.is_timestamp,
    pa.types.is_duration,
    pa.types.is_decimal,
)


def described(file: pq.ParquetFile, path: str) -> Dialect:
    """The file's columns as fields; a list of k values is k fields, `name_0` and so on."""
    start = next(file.iter_batches(1), None)
    if not start:
        raise LogError("has no data", path)
    fields = _fields(start, _widths(file), path)
    kinds = tuple(
        Kind.NUMBER if any(is_(cells.type) for is_ in NUMBERS) else Kind.TEXT
        for cells in fields.values()
    )
    sample = tuple(str(cells[0]) for cells in fields.values())
    return Dialect("", ".", tuple(fields), kinds, len(fields), sample=sample)


def tables(file: pq.ParquetFile, plan: Plan, path: str) -> Iterator[Table]:
    """The wanted rows, one table per batch."""
    wanted = [plan.dialect.columns[place] for place in plan.places]
    columns = [column.name for column in file.schema_arrow if _holds(column, wanted)]
    widths, row = _widths(file), 0
    for batch in file.iter_batches(BATCH, columns=columns):
        first, stop = (int(min(max(b - row, 0), len(batch))) for b in (plan.start, plan.stop))
        part = batch.slice(first, max(stop - first, 0))
        yield _table(_fields(part, widths, path), row + first, row := row + len(batch), plan)


def _table(fields: dict[str, pa.Array], first: int, rows: int, plan: Plan) -> Table:
    """A batch whose first data row is `first`; `rows` is where the next batch begins."""
    cells = [fields[plan.dialect.columns[place]] for place in plan.places]
    values = np.empty((len(cells[0]), len(cells)), order="F")
    empty = np.zeros_like(values, dtype=bool)
    for k, column in enumerate(cells):
        values[:, k] = numbers(column)
        empty[:, k] = column.is_null()
    line = np.zeros(len(values), dtype=np.intp)
    at = np.arange(first, first + len(values))
    return plan.table(values, line, at, blanks(values, empty, line), rows)


def _widths(file: pq.ParquetFile) -> dict[str, int]:
    """Column -> values in each of its lists, as in the first that has any; else 1."""
    widths = {column.name: 0 for column in file.schema_arrow if _is_list(column.type)}
    for batch in file.iter_batches(LOOK, columns=list(widths)):
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            lengths = np.asarray(pc.fill_null(pc.list_value_length(column), 0))
            widths[name] = widths[name] or int(next(iter(lengths[lengths > 0]), 0))
        if all(widths.values()):
            break
    return {name: width or 1 for name, width in widths.items()}


def _fields(batch: pa.RecordBatch, widths: dict[str, int], path: str) -> dict[str, pa.Array]:
    """Name -> cells of every field."""
    pairs = [
        (name, cells)
        for column, whole in zip(batch.schema.names, batch.columns, strict=True)
        for name, cells in _split(rename(column), whole, widths.get(column, 0), path)
    ]
    if twice := duplicates(name for name, _ in pairs):
        raise LogError(f"two columns are called {twice[0]}", path)
    return dict(pairs)


def _split(name: str, column: pa.Array, width: int, path: str) -> list[tuple[str, pa.Array]]:
    """The fields of a column: itself, or one for every place of its lists.

    They are null where a list is, or where it is empty; LogError where one has another length.
    """
    if not width:
        return [(name, column)]
    lengths = np.asarray(pc.fill_null(pc.list_value_length(column), 0))
    filled = lengths > 0
    if (lengths[filled] != width).any():
        raise LogError("has lists of more than one length", path)
    cells = (column if filled.all() else column.filter(pa.array(filled))).flatten()
    at = width * (np.cumsum(filled) - 1)
    places = (pa.array(at + k, mask=~filled) for k in range(width))
    return [(f"{name}_{k}", cells.take(place)) for k, place in enumerate(places)]


def _is_list(of: pa.DataType) -> bool:
    return any(is_(of) for is_ in LISTS)


def _holds(column: pa.Field, wanted: list[str]) -> bool:
    """Does a column hold one of the wanted fields?"""
    name = rename(column.name)
    if _is_list(column.type):
        return any(field.startswith(f"{name}_") for field in wanted)
    return name in wanted
