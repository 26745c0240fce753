"""Blocks with damage -> numbers, line by line: non-rows are left out, non-numbers are NaN."""

from __future__ import annotations

import numpy as np

from urdyn.io.blocks import Block
from urdyn.io.cells import fields, is_empty, number, stamp
from urdyn.io.dialect import Dialect, Kind
from urdyn.io.plan import Plan
from urdyn.io.table import AS_NAN, LEFT_OUT, SKIPPED, Table, merge
from urdyn.types import Defect


def damaged(block: Block, row: int, plan: Plan) -> Table:
    """The wanted rows of a block whose first data row is `row`, and what is amiss with the rest."""
    kept: list[list[float]] = []
    line: list[int] = []
    rows: list[int] = []
    defects: list[Defect] = []
    for at, text, whole in _lines(block):
        cells = fields(text, plan.dialect.delimiter)
        kind, remedy = _flaw(text, cells, whole, plan.dialect)
        wanted = plan.start <= row < plan.stop
        if wanted and kind:
            defects.append(Defect(kind, 1, at, remedy))
        elif wanted:
            kept.append([_value(cells, k, at, plan.dialect, defects) for k in plan.places])
            line.append(at)
            rows.append(row)
        row += remedy != SKIPPED
    values = np.array(kept, dtype=np.float64).reshape(-1, len(plan.places))
    places = np.array(line, dtype=np.intp), np.array(rows, dtype=np.intp)
    return plan.table(values, *places, merge(defects), row)


def _lines(block: Block) -> list[tuple[int, str, bool]]:
    """Number and text of every line, and whether it ends in a line feed."""
    texts = block.data.decode(errors="replace").split("\n")
    numbered = [(block.line + k, text.rstrip("\r"), True) for k, text in enumerate(texts)]
    at, last, _ = numbered.pop()
    return [*numbered, (at, last, False)] if last else numbered


def _flaw(text: str, cells: list[str], whole: bool, dialect: Dialect) -> tuple[str, str]:
    """Why a line is not a row of data, and what becomes of it; "" if it is one."""
    if not text.strip():
        return "blank line", SKIPPED
    if text.strip() == dialect.header:
        return "repeated header", SKIPPED
    if "\0" in text:
        return "null bytes", LEFT_OUT
    if len(cells) < dialect.filled:
        return "short row" if whole else "truncated row", LEFT_OUT
    if any(cell.strip() for cell in cells[len(dialect.columns) :]):
        return "long row", LEFT_OUT
    return "", ""


def _value(
    cells: list[str], place: int, line: int, dialect: Dialect, defects: list[Defect]
) -> float:
    """The number in one cell; where there is none, NaN and one more defect."""
    text = cells[place] if place < len(cells) else ""
    read = stamp if dialect.kinds[place] is Kind.STAMP else number
    try:
        value = read(text.replace(dialect.decimal, "."))
    except (ValueError, OverflowError):
        kind = "empty field" if is_empty(text) else "text in place of a number"
        defects.append(Defect(kind, 1, line, AS_NAN))
        return np.nan
    if np.isnan(value):
        defects.append(Defect("NaN", 1, line, AS_NAN))
    return value
