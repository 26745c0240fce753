"""Joint angles and their derivatives at the stamps of the measured current."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from urdyn.given import given
from urdyn.signal.polynomial import ORDERS, UNIFORM, LocalPolynomial, joint_by_joint, weights
from urdyn.signal.stretches import breaks, median_step, windows
from urdyn.types import Array, Index, Mask

BLOCK = 32768  # rows that are processed at a time
BATCH = 2**14  # samples of windows that are solved at a time: their equations stay in the cache


class Kinematics(NamedTuple):
    """How the joints moved."""

    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    a: Array  # (N, J) [rad/s²]
    jerk: Array  # (N, J) [rad/s³]


def kinematics(
    t: Array,
    q: Array,
    v: Array | None = None,
    *,
    offset: ArrayLike = 0.0,
    half: int = 4,
    ahead: int | None = None,
    degree: int = 4,
    step: float | None = None,
) -> Kinematics:
    """Local polynomial through angles and velocities around each stamp, evaluated at t + offset.

    t (N,) [s], increasing, of any steps; q (N, J) [rad] and v (N, J) [rad/s], NaN where not
    measured. `offset` [s], () or (J,): by how much the current leads the joint's own stream.
    `half` samples to each side, near a gap as many on one side; `ahead`: so many of them after the
    stamp, None: half of them. `step` [s] is the usual one, where
    t is only a part of a log. The window does not move with the offset, so that the estimate is
    smooth in it and the offset can be fitted. NaN where too little was measured.
    """
    fit = LocalPolynomial(half, degree, median_step(t) if step is None else step)
    later = fit.half if ahead is None else ahead
    first, last = windows(len(t), breaks(t, fit.step), fit.half, later)
    rate = np.full_like(q, np.nan) if v is None else v
    leads = given(offset, "offset", "a finite time [s]", streams=q.shape[1])
    out = np.empty((ORDERS, *q.shape))
    for start in range(0, len(t), BLOCK):
        rows = np.arange(start, min(start + BLOCK, len(t)))
        lo, hi = int(first[rows[0]]), int(last[rows[-1]])
        ends = rows - lo, first[rows] - lo, last[rows] - lo
        out[:, rows] = _Block(fit, later, t[lo:hi], q[lo:hi], rate[lo:hi], *ends).solve(leads)
    return Kinematics(*out)


@dataclass(frozen=True, eq=False)
class _Block:
    """Some rows to estimate, with all the rows that their windows touch.

    Which way a row is computed depends on its own window alone, so that the cut into blocks, or
    into the chunks of a stream, cannot be seen in the result.
    """

    fit: LocalPolynomial
    ahead: int  # rows after its own, in a window
    t: Array  # (n,) [s]
    q: Array  # (n, J) [rad]
    v: Array  # (n, J) [rad/s]
    row: Index  # (k,) rows to estimate
    first: Index  # (k,) first row of their windows
    last: Index  # (k,) last + 1

    def solve(self, offset: Array) -> Array:
        """Each order of the motion, (4, k, J), at t + offset (J,) [s]."""
        out = np.empty((ORDERS, len(self.row), len(offset)))
        both, angles, alike = self._kinds()
        for chosen, velocities in ((both, True), (angles, False)):
            if chosen.any():
                uniform = self._convolve(offset, velocities)
                out[:, chosen] = uniform[:, self.first[chosen]]
        rest = ~(both | angles)
        for rows in self._batches(rest & alike):
            out[:, rows] = self.fit.estimate(*self._gather(rows, offset))
        for rows in self._batches(rest & ~alike):
            single = self.fit.estimate(*joint_by_joint(*self._gather(rows, offset)))
            out[:, rows] = single.reshape(ORDERS, len(rows), -1)
        return out

    def _kinds(self) -> tuple[Mask, Mask, Mask]:
        """Uniform windows with all velocities, with none; windows measured alike in all joints."""
        has_q, has_v = np.isfinite(self.q), np.isfinite(self.v)
        uneven = np.abs(np.diff(self.t) - self.fit.step) > UNIFORM * self.fit.step
        length = self.last - self.first
        uniform = (length == self.fit.samples) & (self.last == self.row + self.ahead + 1)
        uniform &= _count(uneven, self.first, self.last - 1) == 0
        uniform &= self._all(np.all(has_q, axis=1))
        same = np.all((has_q == has_q[:, :1]) & (has_v == has_v[:, :1]), axis=1)
        both = uniform & self._all(np.all(has_v, axis=1))
        angles = uniform & self._all(~np.any(has_v, axis=1))
        return both, angles, self._all(same)

    def _all(self, flags: Mask) -> Mask:
        """Windows in which every row is flagged, (k,)."""
        everywhere: Mask = _count(flags, self.first, self.last) == self.last - self.first
        return everywhere

    def _convolve(self, offset: Array, velocities: bool) -> Array:
        """Every window of the block by the weights of a uniform one, (4, n - m + 1, J)."""
        out = np.empty((ORDERS, max(0, len(self.t) - self.fit.samples + 1), len(offset)))
        for joint, at in enumerate(offset):
            centre = (self.fit.half - self.ahead) * self.fit.step
            of_q, of_v = weights(self.fit, centre + float(at), velocities)
            q, v = self.q[:, joint].copy(), self.v[:, joint].copy()  # side by side in memory
            for k in range(ORDERS):
                out[k, :, joint] = np.correlate(q, of_q[k])
                if velocities:
                    out[k, :, joint] += np.correlate(v, of_v[k])
        return out

    def _batches(self, flags: Mask) -> list[Index]:
        """Flagged rows, some at a time."""
        rows, many = np.flatnonzero(flags), max(1, BATCH // self.fit.samples)
        return [rows[start : start + many] for start in range(0, len(rows), many)]

    def _gather(self, rows: Index, offset: Array) -> tuple[Array, Array, Array, Array]:
        """Windows as `LocalPolynomial.estimate` takes them, time counted from their own row."""
        last = self.last[rows, None] - 1
        index = self.first[rows, None] + np.arange(self.fit.samples)
        outside = (index > last)[..., None]
        index = np.minimum(index, last)
        q, v = (np.where(outside, np.nan, values[index]) for values in (self.q, self.v))
        at = np.broadcast_to(offset, (len(rows), len(offset)))
        return self.t[index] - self.t[self.row[rows], None], q, v, at


def _count(flags: Mask, first: Index, last: Index) -> Index:
    """Flags that are set in first:last, (k,)."""
    total = np.concatenate([[0], np.cumsum(flags)])
    return np.asarray(total[last] - total[first])
