"""Refuses a live robot that is not the twin's, by its first movements, as for a recording."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from urdyn.model.arm import Arm
from urdyn.model.whose import FEW, ROWS, require_own
from urdyn.signal import BESIDE, POSE
from urdyn.tracking.sources.source import Arrival
from urdyn.types import Array, Log, Source

APART = 0.1  # [rad] that some joint moves from one pose to the next: an arm at rest tells nothing


def of_this_arm(arm: Arm, arrivals: Iterator[Arrival], name: str) -> Iterator[Arrival]:
    """A robot's arrivals; LogError, with its `name`, once its tool pose is another arm's.

    That is checked with FEW poses, with twice as many, and so on up to ROWS.
    """
    told, last, due = list[Array](), np.full(arm.joints, np.inf), FEW
    for arrival in arrivals:
        if POSE in arrival.sample.beside and np.abs(arrival.sample.q - last).max() > APART:
            told, last = [*told, arrival.sample.beside[POSE][-1]], arrival.sample.q
            if len(told) == due:
                require_own(arm, _log(np.array(told), name))
                due = min(2 * due, ROWS)
        yield arrival
        if len(told) == ROWS:
            break
    yield from arrivals


def _log(rows: Array, name: str) -> Log:
    """A log of the controller's poses, from the rows that samples bring."""
    channels = {BESIDE[POSE]: rows[:, 1:7], "actual_q": rows[:, 7:]}
    return Log(rows[:, 0], channels, Source(name))
