"""A moment of work, half a second, as the information in it: all that slow kinds need.

    A = sum H' R^-1 H        b = sum H' R^-1 r

Rows are averaged first, down to AVERAGED a second: what is slow is not lost, what is noise is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.rows import STANDING, Rows, derivatives
from urdyn.types import Array, Index

AVERAGED = 50.0  # [Hz] rows that are left at most


@dataclass(frozen=True, eq=False)
class Pool:
    """What some rows say about the n states."""

    A: Array  # (n, n)
    b: Array  # (n,)
    count: Array  # (J,) values of current
    warm: Array  # (3, J) mean of the rows'


def pooled(rows: Rows, period: float, noise: Array) -> Pool:
    """The information of joints that slide on known bristles.

    Args:
        period: [s] between rows.
        noise: sd of white noise as loud at low frequencies as the residual is, (J,) [A].
    """
    told = rows.settled & (np.abs(rows.v) > STANDING) & np.isfinite(rows.residual)
    r = np.where(told, rows.residual, 0.0)
    width = max(1, int(1.0 / (AVERAGED * period) + 0.01))
    at: Index = np.arange(0, len(rows), width)
    weight = told / (noise**2 + rows.doubt**2)
    total, H, mean = _means(weight, rows, r, at)
    root = np.sqrt(total)
    scaled = (root[..., None] * H).reshape(-1, H.shape[2])
    y = (root * mean).ravel()
    warm = rows.warm.mean(axis=0)
    return Pool(scaled.T @ scaled, scaled.T @ y, told.sum(axis=0), warm)


def together(pools: Sequence[Pool]) -> Pool:
    """Moments as one."""
    names = ("A", "b", "count")
    A, b, count = (np.sum([getattr(pool, name) for pool in pools], axis=0) for name in names)
    return Pool(A, b, count, np.mean([p.warm for p in pools], axis=0))


def _means(weight: Array, rows: Rows, r: Array, at: Index) -> tuple[Array, Array, Array]:
    """Weights, and weighted means of H and r, of the groups that begin at the rows `at`."""
    total = np.add.reduceat(weight, at, axis=0)
    group = np.searchsorted(at, np.arange(len(r)), side="right") - 1
    share = weight / np.where(total > 0.0, total, 1.0)[group]
    rigid = np.add.reduceat(share[..., None] * rows.rigid, at, axis=0)
    drive = np.add.reduceat(share[:, None] * rows.drive, at, axis=0)
    return total, derivatives(rigid, drive), np.add.reduceat(share * r, at, axis=0)
