"""All that a diagnosis keeps from instant to instant."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from urdyn.diagnose.fast.encoder import Unseen
from urdyn.diagnose.fast.fast import FastState
from urdyn.diagnose.findings.ledger import Book, Findings
from urdyn.diagnose.kinds.change import Push
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.warmth import Warmth
from urdyn.diagnose.slow.slow_state import SlowState
from urdyn.signal import Instant
from urdyn.types import Array, Motion


@dataclass(frozen=True, eq=False)
class Now:
    """One instant from a tracker."""

    instant: Instant
    s: Array  # (J,) presliding state [-]
    travelled: Array  # (J,) [rad] since the bristles were unknown


@dataclass(frozen=True, eq=False)
class State:
    """What the tests know, what waits for them, and what was found."""

    fast: FastState
    slow: SlowState
    warmth: Warmth
    off: Array  # (J,) [rad] offset of encoders from reported jumps
    unseen: Unseen
    chunk: tuple[Now, ...] = ()  # not yet compared with the model
    beat: tuple[Rows, ...] = ()
    moment: tuple[Rows, ...] = ()
    book: Book = field(default_factory=Book)
    push: Push = field(default_factory=Push)  # in the moment, if any
    last: float = -np.inf  # [s] stamp of the last instant
    ahead: float = 0.0  # [s] ahead of the robot's clock, which was set back

    @property
    def findings(self) -> Findings:
        """Findings as last reported."""
        return self.book.findings


def motion_of(chunk: tuple[Now, ...]) -> tuple[Motion, Array, Array]:
    """Instants as a motion, with presliding states and travels."""
    one = [now.instant for now in chunk]
    motion = Motion(
        t=np.array([i.t for i in one]),
        q=np.array([i.q for i in one]),
        v=np.array([i.v for i in one]),
        a=np.array([i.a for i in one]),
        jerk=np.array([i.jerk for i in one]),
        current=np.array([i.current for i in one]),
        temperature=np.array([i.temperature for i in one]),
        shift=np.array([i.shift for i in one]),
        instrument=np.array([i.instrumental for i in one]),
    )
    return motion, np.array([n.s for n in chunk]), np.array([n.travelled for n in chunk])
