"""Which poses to measure: the most informative, greedily, then improved by exchanges."""

from __future__ import annotations

import numpy as np

from urdyn.identify.kinematics.placement import Placement, groups, slopes
from urdyn.identify.kinematics.spread import ANYWHERE, geometry_spread
from urdyn.identify.kinematics.workspace import roam
from urdyn.model.arm import Arm
from urdyn.types import Array

CANDIDATES = 500
EXCHANGES = 2  # rounds in which every pose may be exchanged for a better one
TRACKER = np.array([5e-5, 5e-5, 5e-5, 2e-4, 2e-4, 2e-4])  # [m, rad] typical noise of a tracker


def most_informative(
    arm: Arm,
    placement: Placement,
    count: int,
    rng: np.random.Generator,
    known: Array | None = None,
) -> Array:
    """The most informative poses (count, J) [rad] among those the arm can take (`roam`).

    They maximise the determinant of the information on geometry, base and tool [Fedorov1972]_.

    Args:
        known: existing information on all unknowns; None: the prior's.
    """
    candidates = roam(arm, max(CANDIDATES, 3 * count), rng)
    size = int(groups(placement)["tool"][-1]) + 1
    A = slopes(placement, candidates)[:, :, :size] / TRACKER[:, None]
    flat = np.full(size - int(placement.form.free.sum()), ANYWHERE)
    prior = np.diag(np.concatenate([geometry_spread(placement.form), flat]) ** -2.0)
    information = prior if known is None else known
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(_next(A, information, chosen))
        information = information + A[chosen[-1]].T @ A[chosen[-1]]
    for _ in range(EXCHANGES):
        for k in range(count):
            information = information - A[chosen[k]].T @ A[chosen[k]]
            chosen[k] = _next(A, information, [*chosen[:k], *chosen[k + 1 :]])
            information = information + A[chosen[k]].T @ A[chosen[k]]
    return np.asarray(candidates[chosen])


def _next(A: Array, information: Array, taken: list[int]) -> int:
    """The candidate not yet taken that raises the determinant most: det(I + A cov A')."""
    scale = 1.0 / np.sqrt(np.diag(information))
    root = np.linalg.cholesky(scale[:, None] * information * scale)
    solved = np.linalg.solve(root, (A * scale).transpose(2, 0, 1).reshape(len(root), -1))
    shape = solved.reshape(len(root), len(A), A.shape[1]).transpose(1, 2, 0)
    gain = np.linalg.slogdet(np.eye(A.shape[1]) + shape @ shape.transpose(0, 2, 1))[1]
    gain[taken] = -np.inf
    return int(np.argmax(gain))
