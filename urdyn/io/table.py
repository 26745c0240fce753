"""A recording as numbers, not yet mended: every row keeps its line of the file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.types import Array, Defect, Index, Mask

LEFT_OUT = "left out"  # a row that was lost: it counts against the log
SKIPPED = "skipped"  # a line that held nothing
AS_NAN = "kept as NaN"


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of numbers by channel; `timestamp` is a channel as any other."""

    channels: dict[str, Array]  # RTDE name -> (N,) or (N, width); NaN where a cell has no number
    line: Index  # (N,) line of the file, from 1; 0 in a format without lines
    row: Index  # (N,) data row of the file, from 0, lost ones counted
    defects: tuple[Defect, ...] = ()
    rows: int = 0  # data rows met so far in the file, lost ones counted

    def __len__(self) -> int:
        return len(self.line)

    def take(self, rows: Mask) -> Table:
        """Some of the rows; a channel at a time, so that memory never holds the log twice."""
        channels = {name: self.channels.pop(name)[rows] for name in list(self.channels)}
        return replace(self, channels=channels, line=self.line[rows], row=self.row[rows])


def join(pieces: Sequence[Table]) -> Table:
    """Pieces of one file, one after the other; the pieces are used up."""
    channels = {
        name: np.concatenate([piece.channels.pop(name) for piece in pieces])
        for name in list(pieces[0].channels)
    }
    return Table(
        channels,
        np.concatenate([piece.line for piece in pieces]),
        np.concatenate([piece.row for piece in pieces]),
        merge(defect for piece in pieces for defect in piece.defects),
        pieces[-1].rows,
    )


def merge(defects: Iterable[Defect]) -> tuple[Defect, ...]:
    """One defect per kind and remedy: counts added, the first line kept."""
    merged: dict[tuple[str, str], Defect] = {}
    for defect in defects:
        known = merged.get((defect.kind, defect.remedy))
        if known:
            line = min(known.line or defect.line, defect.line or known.line)
            defect = replace(defect, count=known.count + defect.count, line=line)
        if defect.count:
            merged[defect.kind, defect.remedy] = defect
    return tuple(merged.values())
