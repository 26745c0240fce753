"""Samples that wait to be learnt from together, as many as doubt about a current allows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.estimate.innovation import Rows
from urdyn.types import Array, Index, Mask

LITTLE, MUCH = 0.05, 0.2  # [-] a current's variance due to doubt, over its noise's


@dataclass(frozen=True, eq=False)
class Waiting:
    """Sums of samples not yet learnt from; row j is joint j's current.

    Samples without a current do not count.
    """

    H: Array  # (J, n) [A] per unit of each state
    residual: Array  # (J,) [A]
    R: Array  # (J,) [A²]
    count: Index  # (J,) number of samples
    interval: Index  # (J,) samples between two updates by a joint
    sample: int = 0  # number so far: joints with equal intervals are learnt from together

    def added(self, H: Array, residual: Array, R: Array) -> Waiting:
        """With one more sample, all 0 where there is no current."""
        more = self.count + (R > 0.0)
        if self.count.any():
            goes_on = self.count > 0
            H = H + goes_on[:, None] * self.H
            residual, R = residual + goes_on * self.residual, R + goes_on * self.R
        return Waiting(H, residual, R, more, self.interval, self.sample + 1)

    def due(self, calm: bool) -> Mask:
        """Joints that have waited long enough, (J,)."""
        return np.asarray((self.count > 0) & (not calm or self.sample % self.interval == 0))

    def nearer(self, step: Array) -> Waiting:
        """What waits, with residuals about a mean that moved by `step`, (n,)."""
        if not self.count.any():
            return self
        return replace(self, residual=self.residual - self.H @ step)

    def hurried(self) -> Waiting:
        """With every joint to be learnt from at once."""
        return replace(self, interval=np.ones_like(self.interval))

    def emptied(self, rows: Rows = slice(None)) -> Waiting:
        """Without what waits of these joints."""
        count = self.count.copy()
        count[rows] = 0
        return Waiting(self.H, self.residual, self.R, count, self.interval, self.sample)

    def learnt(self, rows: Rows, share: Array, longest: int) -> Waiting:
        """With these joints, (r,), emptied, and their intervals lengthened or shortened.

        Args:
            share: variance of the sum due to doubt, over its noise's, (r,) [-].
            longest: samples that a joint may wait for.
        """
        if longest == 1:
            return self.emptied(rows)
        interval = self.interval.copy()
        next_one = np.where(share < LITTLE, 2 * interval[rows], interval[rows])
        next_one = np.where(share > MUCH, interval[rows] // 2, next_one)
        interval[rows] = np.clip(next_one, 1, longest)
        return replace(self.emptied(rows), interval=interval)


def nothing_waits(joints: int, states: int) -> Waiting:
    """The sums before the first sample."""
    return Waiting(
        H=np.zeros((joints, states)),
        residual=np.zeros(joints),
        R=np.zeros(joints),
        count=np.zeros(joints, dtype=np.intp),
        interval=np.ones(joints, dtype=np.intp),
    )
