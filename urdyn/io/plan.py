"""What is to be read of a text recording, and how read numbers become a table."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.io.dialect import Dialect
from urdyn.io.names import Layout, used
from urdyn.io.table import Table
from urdyn.types import Array, Defect, Index


@dataclass(frozen=True)
class Plan:
    """How a file is written, and what is wanted of it."""

    dialect: Dialect
    layout: Layout
    start: int = 0  # first data row that is wanted
    stop: float = np.inf  # first that is not wanted any more

    @cached_property
    def places(self) -> list[int]:
        """Fields that are read, in the order of the file, (W,)."""
        return used(self.layout)

    def table(
        self, values: Array, line: Index, row: Index, defects: tuple[Defect, ...], rows: int
    ) -> Table:
        """Channels from the wanted fields, (N, W); a column that the file lacks is NaN."""
        at = {place: k for k, place in enumerate(self.places)}
        padded = {-1: np.full(len(values), np.nan)}
        channels: dict[str, Array] = {}
        for name, places in self.layout.items():
            if isinstance(places, int):
                channels[name] = values[:, at[places]].copy()  # a view would keep all of `values`
            else:
                columns = [values[:, at[p]] if p >= 0 else padded[p] for p in places]
                channels[name] = np.stack(columns, axis=1)
        return Table(channels, line, row, defects, rows)
