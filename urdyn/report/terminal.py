"""A table for the terminal, which shows every word as it is written."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text


def terminal_table(
    title: str,
    heads: Sequence[str],
    rows: Iterable[Sequence[str | Text]] = (),
    words: int = 1,
) -> Table:
    """Rows under their heads; the first columns hold `words`, the others numbers.

    All is Text, for rich takes a [b] in a str for markup, and robots' names may contain that.
    """
    named = Text(title, style="table.title")
    table = Table(title=named, title_justify="left", header_style="bold", box=SIMPLE_HEAD)
    for k, head in enumerate(heads):
        # A narrow terminal cuts no digits.
        justify: Literal["left", "right"] = "left" if k < words else "right"
        table.add_column(Text(head), justify=justify, overflow="fold", min_width=0 if k else 8)
    for row in rows:
        table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in row))
    return table
