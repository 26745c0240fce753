"""Data that are named twice: counted twice, they seem more certain than they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from urdyn.errors import LogError
from urdyn.io.mend import STATE
from urdyn.io.table import Table
from urdyn.types import STANDSTILL, Index, Source


def refuse_twice(sources: Sequence[Source]) -> None:
    """LogError where two logs share rows of one file; files are distinguished by content."""
    for one, other in combinations(sources, 2):
        if overlap(one, other):
            raise LogError(f"the same rows as {one.path}; name each log once", other.path)


def overlap(one: Source, other: Source) -> bool:
    """Do two logs share rows?"""
    (a, b), (c, d) = (source.rows or (0, math.inf) for source in (one, other))
    return one.sha256 == other.sha256 and a < d and c < b


def refuse_alike(table: Table, log: Index, sources: Sequence[Source]) -> None:
    """LogError where rows of two logs are alike at the same stamp, while a joint moves.

    No robot that begins anew repeats the noise of its sensors; one at rest may show none, and where
    a logger rounds few joints some rows are alike by chance. One row that ends a file and begins
    the next is a repeated stamp, and kept once.

    Args:
        log: of which of `sources` each row is, (N,).
    """
    if not table.channels.keys() >= set(STATE):
        return
    t, states = table.channels["timestamp"], (table.channels[name] for name in STATE)
    q, v, i = (x if x.ndim > 1 else x[:, None] for x in states)
    order = np.lexsort((q[:, 0], t))  # rows that are alike come one after the other
    one, other = order[:-1], order[1:]
    met = (t[one] == t[other]) & (log[one] != log[other])
    one, other = one[met], other[met]
    moving = (np.abs(v[one]) > STANDSTILL).any(axis=1)
    alike = moving.copy()
    for values in (q, v, i):
        alike &= (values[one] == values[other]).all(axis=1)
    if alike.sum() > max(1.0, 0.5 * moving.sum()):
        first, later = (sources[log[rows[alike][0]]].path for rows in (one, other))
        raise LogError(f"{alike.sum()} of its rows are in {first}, too; cut them out of one", later)
