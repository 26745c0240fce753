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
    residual: Array  # (J,) [A] mean
    H: Array  # (J, n) [A] mean derivatives
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
    _, whole, residual = _means(told.astype(np.float64), rows, r, at[:1])
    warm = rows.warm.mean(axis=0)
    return Pool(scaled.T @ scaled, scaled.T @ y, told.sum(axis=0), residual[0], whole[0], warm)


def together(pools: Sequence[Pool]) -> Pool:
    """Moments as one; means are of what was told."""
    count = np.array([pool.count for pool in pools])
    share = count / np.maximum(count.sum(axis=0), 1.0)
    return Pool(
        A=np.sum([pool.A for pool in pools], axis=0),
        b=np.sum([pool.b for pool in pools], axis=0),
        count=count.sum(axis=0),
        residual=np.sum([w * pool.residual for w, pool in zip(share, pools, strict=True)], axis=0),
        H=np.sum([w[:, None] * pool.H for w, pool in zip(share, pools, strict=True)], axis=0),
        warm=np.mean([pool.warm for pool in pools], axis=0),
    )


def _means(weight: Array, rows: Rows, r: Array, at: Index) -> tuple[Array, Array, Array]:
    """Weights, and weighted means of H and r, of the groups that begin at the rows `at`."""
    total = np.add.reduceat(weight, at, axis=0)
    group = np.searchsorted(at, np.arange(len(r)), side="right") - 1
    share = weight / np.where(total > 0.0, total, 1.0)[group]
    rigid = np.add.reduceat(share[..., None] * rows.rigid, at, axis=0)
    drive = np.add.reduceat(share[:, None] * rows.drive, at, axis=0)
    return total, derivatives(rigid, drive), np.add.reduceat(share * r, at, axis=0)
