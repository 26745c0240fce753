"""Regions of the workspace, by joint angles: a fit must hold where it has no data."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Index

HALVINGS = 3
LEAST = 10  # poses that a region needs


def regions(q: Array) -> Index:
    """(N,) the region of each pose q (N, J) [rad]: poses are halved along their widest direction.

    Angles count as points on circles, and halves are halved again.
    """
    points = np.concatenate([np.cos(q), np.sin(q)], axis=1)
    label = np.zeros(len(q), dtype=np.intp)
    for _ in range(HALVINGS):
        if np.bincount(label).min() < 2 * LEAST and label.any():
            break
        label = 2 * label
        for k in np.unique(label):
            rows = np.flatnonzero(label == k)
            label[rows[_beyond(points[rows])]] += 1
    return label


def _beyond(points: Array) -> Index:
    """Which points lie beyond the median along their principal axis."""
    off = points - points.mean(axis=0)
    along = off @ np.linalg.eigh(off.T @ off)[1][:, -1]
    order = np.argsort(along, kind="stable")
    return order[len(order) // 2 :]
