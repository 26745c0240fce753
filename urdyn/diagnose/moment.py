"""A moment of work, half a second, as the information in it: all that slow kinds need.

    A = sum H' R^-1 H        b = sum H' R^-1 r

Rows are averaged first, down to AVERAGED a second: what is slow is not lost, what is noise is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.rows import STANDING, Rows
from urdyn.types import Array

AVERAGED = 50.0  # [Hz] rows that are left at most


@dataclass(frozen=True, eq=False)
class Pool:
    """What some rows say about the n states."""

    A: Array  # (n, n)
    b: Array  # (n,)
    count: Array  # (J,) values of current
    residual: Array  # (J,) [A] mean
    H: Array  # (J, n) [A] mean derivatives


def empty(joints: int, n: int) -> Pool:
    """Nothing."""
    nothing = np.zeros(joints)
    return Pool(np.zeros((n, n)), np.zeros(n), nothing, nothing, np.zeros((joints, n)))


def pooled(rows: Rows, period: float, noise: Array) -> Pool:
    """The information of joints that slide on known bristles.

    Args:
        period: [s] between rows.
        noise: sd of white noise as loud at low frequencies as the residual is, (J,) [A].
    """
    told = rows.settled & (np.abs(rows.v) > STANDING) & np.isfinite(rows.residual)
    weight = told / (noise**2 + rows.doubt**2)
    r = np.where(told, rows.residual, 0.0)
    n = rows.H.shape[2]
    width = max(1, int(1.0 / (AVERAGED * period) + 0.01))
    at = np.arange(0, len(rows), width)
    total, H, mean = _means(weight, rows.H, r, at)
    scaled = (np.sqrt(total)[..., None] * H).reshape(-1, n)
    y = (np.sqrt(total) * mean).ravel()
    _, whole, residual = _means(told.astype(np.float64), rows.H, r, np.zeros(1, dtype=np.intp))
    return Pool(scaled.T @ scaled, scaled.T @ y, told.sum(axis=0), residual[0], whole[0])


def _means(weight: Array, H: Array, r: Array, at: Array) -> tuple[Array, Array, Array]:
    """Weights, and weighted means of H and r, of the groups that begin at the rows `at`."""
    total = np.add.reduceat(weight, at, axis=0)
    safe = np.where(total > 0.0, total, 1.0)
    mean_h = np.add.reduceat(weight[..., None] * H, at, axis=0) / safe[..., None]
    return total, mean_h, np.add.reduceat(weight * r, at, axis=0) / safe
