"""Blocks without damage -> numbers, on all cores, through Arrow."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from pyarrow import csv

from urdyn.io.blocks import Block
from urdyn.io.cells import NOTHING, stamp
from urdyn.io.dialect import Kind
from urdyn.io.plan import Plan
from urdyn.io.table import AS_NAN, Table
from urdyn.types import Array, Defect, Index

TYPES = {Kind.NUMBER: pa.float64(), Kind.FLAG: pa.bool_(), Kind.STAMP: pa.string()}
REFUSED = (pa.ArrowInvalid, ValueError, OverflowError)  # what `sound` raises on damage


def sound(block: Block, row: int, plan: Plan) -> Table:
    """The wanted rows of a block whose first data row is `row`; REFUSED if anything is amiss."""
    table, lines = _arrow(block, plan), block.lines
    if table.num_rows != lines:
        raise pa.ArrowInvalid("blank lines, or a stray quote that has swallowed some")
    first, stop = (int(min(max(bound - row, 0), lines)) for bound in (plan.start, plan.stop))
    table = table.slice(first, stop - first)
    offset = np.arange(first, max(first, stop))
    values = np.empty((len(offset), table.num_columns), order="F")
    empty = np.zeros_like(values, dtype=bool)
    for k, column in enumerate(table.columns):
        values[:, k] = numbers(column)
        if column.null_count:
            empty[:, k] = column.is_null()
    line = offset + block.line
    return plan.table(values, line, offset + row, blanks(values, empty, line), row + lines)


def _arrow(block: Block, plan: Plan) -> pa.Table:
    """The wanted columns as Arrow parses them."""
    dialect = plan.dialect
    types = {str(k): TYPES[dialect.kinds[k]] for k in plan.places}
    # Arrow's own memory: a worker may free it after the interpreter has ended; if Python owned it,
    # that would abort the process.
    with pa.BufferOutputStream() as own:
        own.write(block.data)
        data = own.getvalue()
    return csv.read_csv(
        pa.BufferReader(data),
        csv.ReadOptions(column_names=[str(k) for k in range(len(dialect.columns))]),
        csv.ParseOptions(delimiter=dialect.delimiter),
        csv.ConvertOptions(
            include_columns=list(types),
            column_types=types,
            null_values=["", *NOTHING],
            strings_can_be_null=True,
            decimal_point=dialect.decimal,
        ),
    )


def numbers(column: pa.Array | pa.ChunkedArray) -> Array:
    """Numbers, flags, times or durations of an Arrow column as float64, (N,); NaN where empty."""
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        return np.array([stamp(text) if text else np.nan for text in column.to_pylist()])
    if pa.types.is_duration(column.type):
        column = column.cast(pa.int64()).cast(pa.timestamp(column.type.unit))  # from 1970 on
    if pa.types.is_timestamp(column.type):
        seconds = column.cast(pa.timestamp("ns")).cast(pa.int64()).cast(pa.float64(), safe=False)
        return numbers(seconds) * 1e-9
    if column.type != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    return np.asarray(column, dtype=np.float64)  # a copy where Arrow needs one: for nulls, pieces


def blanks(values: Array, empty: np.ndarray, line: Index) -> tuple[Defect, ...]:
    """Defects of `empty` fields, and of NaN in the other `values`, (N, W) each."""
    defects = []
    for kind, cells in (("empty field", empty), ("NaN", np.isnan(values) & ~empty)):
        rows = cells.any(axis=1)
        if rows.any():
            at = int(line[rows.argmax()])
            defects.append(Defect(kind, int(cells.sum()), at, AS_NAN))
    return tuple(defects)
