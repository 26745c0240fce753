"""Lines -> numbers: through Arrow where a block is sound, line by line where it is not.

A block that Arrow refuses is halved until the damage is alone, so that one bad line in an hour of
recording costs milliseconds and still is named by its number.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from urdyn.io.blocks import Block
from urdyn.io.damaged import damaged
from urdyn.io.plan import Plan
from urdyn.io.sound import REFUSED, sound
from urdyn.io.table import Table

SMALL = 1 << 14  # [bytes]: below this, halving costs more than reading line by line


def parse(blocks: Iterable[Block], plan: Plan) -> Iterator[Table]:
    """The wanted rows of a file, one table or more per block, in order."""
    row = 0
    for block in blocks:
        for table in _parse(block, row, plan):
            yield table
            row = table.rows


def _parse(block: Block, row: int, plan: Plan) -> Iterator[Table]:
    """A block whose first data row is `row`."""
    if not block.data:
        return
    try:
        yield sound(block, row, plan)
    except REFUSED:
        halves = block.halves() if len(block.data) > SMALL else None
        if not halves:
            yield damaged(block, row, plan)
        for half in halves or ():
            for table in _parse(half, row, plan):
                yield table
                row = table.rows
