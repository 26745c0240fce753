"""A trajectory: the motion commanded to an arm, with interpolation between its rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_each, given_number, positive
from urdyn.types import Array, Motion

ALIKE = 1e-3  # [-] of a step that a stamp may be off, by rounding of digits
BLOCK = 1 << 14  # rows per block, so that memory does not grow with duration


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint angles, velocities and accelerations on a uniform grid; at rest before and after it."""

    t: Array  # (N,) [s], uniform, from 0
    q: Array  # (N, J) [rad]
    v: Array  # (N, J) [rad/s]
    a: Array  # (N, J) [rad/s²]

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", given_each(self.t, "t", (np.size(self.t),)))
        if not (len(self) > 1 and self.t[0] == 0.0 and self.step > 0.0):
            raise InputError("a trajectory has two rows or more, from time 0 on")
        off = np.abs(self.t - self.step * np.arange(len(self))) > ALIKE * self.step
        if off.any():
            told = f"that of row {off.argmax()} is {self.t[off.argmax()]:g} s"
            raise InputError(f"a trajectory has a row every {self.step:g} s; {told}")
        shape = len(self), *np.shape(self.q)[1:]
        for name in ("q", "v", "a"):
            object.__setattr__(self, name, given_each(getattr(self, name), name, shape))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def step(self) -> float:
        """Time between rows [s]."""
        return float(self.t[-1]) / (len(self) - 1)

    def at(self, t: Array) -> Motion:
        """The motion at any times (M,) [s]: quintic Hermite between rows, at rest outside.

        The quintic matches q, v and a of both rows, so it is exact at rows, and to O(step⁶) in q
        between them.
        """
        h = self.step
        row = np.clip(t / h, 0, len(self) - 2).astype(np.intp)
        u = np.clip(t / h - row, 0.0, 1.0)[:, None]
        c0, c1, c2 = self.q[row], h * self.v[row], 0.5 * h**2 * self.a[row]
        D = self.q[row + 1] - c0 - c1 - c2
        V = h * self.v[row + 1] - c1 - 2.0 * c2
        A = h**2 * self.a[row + 1] - 2.0 * c2
        c3, c4, c5 = (
            10.0 * D - 4.0 * V + 0.5 * A,
            -15.0 * D + 7.0 * V - A,
            6.0 * D - 3.0 * V + 0.5 * A,
        )
        q = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
        v = (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h
        a = (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / h**2
        jerk = (6.0 * c3 + u * (24.0 * c4 + u * 60.0 * c5)) / h**3
        inside = ((t >= 0.0) & (t <= self.t[-1]))[:, None]
        v, a, jerk = (np.where(inside, moving, 0.0) for moving in (v, a, jerk))
        unmeasured = np.broadcast_to(np.nan, q.shape)
        return Motion(t, q, v, a, jerk, current=unmeasured, temperature=unmeasured)


def grid(duration: float, rate: float) -> Array:
    """Stamps of `duration` * `rate` rows, (N,) [s]."""
    duration = given_number(duration, "duration", "a time above 0 [s]", positive)
    rate = given_number(rate, "rate", "a rate above 0 [Hz]", positive)
    if not 2.0 <= duration * rate < np.inf:
        raise InputError(
            f"{duration:g} s at {rate:g} Hz are no trajectory; ask for two rows or more"
        )
    return np.arange(round(duration * rate)) / rate


def blocks(rows: int) -> Iterator[slice]:
    """Consecutive slices that cover `rows`."""
    return (slice(start, min(start + BLOCK, rows)) for start in range(0, rows, BLOCK))
