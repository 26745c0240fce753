"""Samples that wait to be learnt from together: how many, a block's own doubt decides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.types import Array

LITTLE, MUCH = 0.05, 0.2  # [-] variance of the expected current that a block adds to its noise's


@dataclass(frozen=True, eq=False)
class Waiting:
    """Samples that a block has not learnt from yet, as their sum; row j is joint j's current."""

    H: Array  # (J, n) [A] per unit of each state
    residual: Array  # (J,) [A]
    R: Array  # (J,) [A²]; 0 where there is nothing
    dt: float  # [s] that they span
    still: float  # [s] since the block was last moved
    count: int
    interval: int  # samples to wait for

    def added(self, H: Array, residual: Array, R: Array, u: RobotSlice) -> Waiting:
        """One more."""
        first = not self.count
        return Waiting(
            H=H if first else self.H + H,
            residual=residual if first else self.residual + residual,
            R=R if first else self.R + R,
            dt=u.dt if first else self.dt + u.dt,
            still=self.still + u.span,
            count=self.count + 1,
            interval=self.interval,
        )

    def nearer(self, step: Array) -> Waiting:
        """What waits, seen from a mean that has moved, (n,)."""
        return replace(self, residual=self.residual - self.H @ step)

    def done(self, own: Array, calm: bool, longest: int) -> Waiting:
        """Nothing waits; the next sum is longer or shorter by how much this one moved the block.

        Args:
            own: variance of the sum by the block's own doubt, (J,) [A²].
        """
        if longest == 1 or not calm:
            return self._emptied(1)
        share = float((own / np.where(self.R > 0.0, self.R, np.inf)).max())
        slower = self.interval * 2 if share < LITTLE else self.interval
        interval = self.interval // 2 if share > MUCH else slower
        return self._emptied(min(max(interval, 1), longest))

    def _emptied(self, interval: int) -> Waiting:
        """The last sum stays where it is: by the count, it is nothing."""
        return Waiting(
            H=self.H,
            residual=self.residual,
            R=self.R,
            dt=0.0,
            still=self.still,
            count=0,
            interval=interval,
        )


def nothing_waits(joints: int, states: int) -> Waiting:
    """Before the first sample."""
    return Waiting(
        H=np.zeros((joints, states)),
        residual=np.zeros(joints),
        R=np.zeros(joints),
        dt=0.0,
        still=0.0,
        count=0,
        interval=1,
    )
