"""An encoder that tells nothing while the others do: it is silent, or stuck, which is no angle.

(One whose zero jumps is in `zero`; one whose zero creeps is among the slow kinds.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.event import CERTAIN, USELESS, Event
from urdyn.types import Array, Mask

ENCODER = "encoder"  # the mode of a sensor fault that is one of angles


@dataclass(frozen=True, eq=False)
class Unseen:
    """Of which joints nothing was told of late."""

    since: Array  # (J,) [s]; NaN: its angle is known
    told: Mask  # (J,) that it is not


def all_seen(joints: int) -> Unseen:
    """Every angle is known."""
    return Unseen(np.full(joints, np.nan), np.zeros(joints, dtype=bool))


def unseen(
    before: Unseen, t: float, silent: Mask, rule: Mapping[str, float]
) -> tuple[Unseen, list[Event]]:
    """An instant on; an event of each encoder that was silent for long by now.

    Args:
        silent: of which joints nothing is told, (J,); of all of them, it is a gap.
        rule: held [s].
    """
    alone = silent & ~silent.all()
    since = np.where(alone, np.fmin(before.since, t), np.nan)
    told = alone & (t - since >= rule["held"])
    new = np.flatnonzero(told & ~before.told).tolist()
    return Unseen(since, told), [_event(j, float(since[j]), t) for j in new]


def ever_unseen(t: Array, silent: Mask, rule: Mapping[str, float]) -> list[Event]:
    """The events of a whole recording, (N,) [s] and (N, J)."""
    state, events, last = all_seen(silent.shape[1]), list[Event](), -1
    for k in np.flatnonzero(silent.any(axis=1)).tolist():
        if k > last + 1:
            state = all_seen(silent.shape[1])
        state, new = unseen(state, float(t[k]), silent[k], rule)
        events, last = events + new, k
    return events


def _event(j: int, onset: float, now: float) -> Event:
    return Event(
        kind="sensor_fault",
        joint=j,
        onset=onset,
        alarm=now,
        confidence=CERTAIN,
        size=USELESS,
        evidence={"mode": ENCODER},
    )
