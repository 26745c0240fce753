"""Fourier series as vectors: x (n,) <-> Series, and a series' motion at given times.

Projection restricts the coefficients to series at rest at whole periods, and scaling makes an equal
step in each entry of x change the velocity equally.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.simulate.fourier import Series, at_rest
from urdyn.types import Array, freeze


@dataclass(frozen=True, eq=False)
class Basis:
    """Series of H harmonics over a period, sampled at N times."""

    joints: int
    harmonics: int
    period: float  # [s]
    times: Array  # (N,) [s]
    free: Array  # (2 H, 2 H): coefficients = free @ x
    tables: Array  # (3, N, 1 + 2 H): q, v, a = tables @ [middle; coefficients]

    def __post_init__(self) -> None:
        freeze(self, "times", "free", "tables")

    @property
    def size(self) -> int:
        """Length of x."""
        return (1 + 2 * self.harmonics) * self.joints

    def vector(self, series: Series) -> Array:
        """x of a series that starts at rest."""
        k = np.arange(1.0, self.harmonics + 1.0)[:, None]
        return np.concatenate([series.middle[None], k * series.sine, k * series.cosine]).ravel()

    def series(self, x: Array) -> Series:
        """The series of x."""
        middle, sine, cosine = np.split(self._whole(x), [1, 1 + self.harmonics])
        return Series(middle[0], sine, cosine, self.period)

    def motion(self, x: Array) -> tuple[Array, Array, Array]:
        """q, v, a at the times, (N, J) each."""
        q, v, a = self.tables @ self._whole(x)
        return q, v, a

    def gradient(self, dq: Array, dv: Array, da: Array) -> Array:
        """Gradient in x, from gradients in the motion, (N, J) each."""
        table = self.tables
        whole = table[0].T @ dq + table[1].T @ dv + table[2].T @ da
        return np.concatenate([whole[:1], self.free.T @ whole[1:]]).ravel()

    def _whole(self, x: Array) -> Array:
        """Middle and coefficients, (1 + 2 H, J)."""
        grid = x.reshape(-1, self.joints)
        return np.concatenate([grid[:1], self.free @ grid[1:]])


def basis(joints: int, harmonics: int, period: float, rows: int) -> Basis:
    """Series of `harmonics` over `period` [s], sampled at `rows` times."""
    k = np.arange(1.0, harmonics + 1.0)
    sine, cosine = (np.diag(1.0 / k) for _ in range(2))
    still = at_rest(sine, cosine)
    none = np.zeros((harmonics, harmonics))
    free: Array = np.block([[still[0], none], [none, still[1]]])
    times = np.linspace(0.0, period, rows, endpoint=False)
    w = 2.0 * np.pi / period * k
    s, c = np.sin(np.outer(times, w)), np.cos(np.outer(times, w))
    one, zero = np.ones((rows, 1)), np.zeros((rows, 1))
    tables = np.array(
        [
            np.hstack([one, s, c]),
            np.hstack([zero, c * w, -s * w]),
            np.hstack([zero, -s * w**2, -c * w**2]),
        ]
    )
    return Basis(joints, harmonics, period, times, free, tables)
