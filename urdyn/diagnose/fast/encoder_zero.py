"""An encoder whose zero jumps between two samples. (One that creeps is among the slow kinds.)"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import JUMPS
from urdyn.diagnose.residual.rows import Rows
from urdyn.types import Array

BACK = 5.0  # [s] within which a jump the other way is a jump back
TURNED = 3  # jumps back, from which it is no zero: the angle is noisy, or loose


def shifted(rows: Rows, least: float) -> list[Event]:
    """Shifts of `least` [rad] or more in a beat."""
    found = np.argwhere(jumps(rows.shift, least))
    return [_event(rows, k, j) for k, j in found.tolist()]


def jumps(shift: Array, least: float) -> Array:
    """Shifts of (N, J) [rad] that large; 0 elsewhere."""
    return np.where(np.abs(shift) >= least, shift, 0.0)


def beside(event: Event, before: Finding, least: float) -> Event:
    """A jump of a zero that had jumped before: their sum, or that it is right again.

    For one that goes to and fro they are not added: it is as far off as its last jump.
    """
    now, last = event.evidence, before.evidence
    back = now["jump_rad"] * last["jump_rad"] < 0.0 and now["jump_s"] - last["jump_s"] < BACK
    turned = last["turned"] + int(back)
    event = replace(event, evidence={**now, "turned": turned, "to_and_fro": turned >= TURNED})
    if turned >= TURNED:
        return event
    left = before.size + event.size
    if abs(left) >= least:
        return replace(event, size=left)
    evidence = {**event.evidence, "was_rad": before.size, "until_s": event.onset}
    return replace(event, onset=before.onset_s, size=0.0, evidence=evidence, goes_on=True)


def _event(rows: Rows, k: int, j: int) -> Event:
    """The joint has not moved: its angle reads higher, so its zero lies as much lower."""
    jump = float(rows.shift[k, j])
    evidence = {"statistic": "jump of an angle that no motion explains", "jump_rad": jump}
    evidence |= {"jump_s": float(rows.t[k]), "turned": 0}
    return Event(
        kind=JUMPS,
        joint=j,
        onset=float(rows.t[k]),
        alarm=float(rows.t[-1]),
        size=-jump,
        evidence=evidence,
    )
