"""What data can determine: rank of the linear problem, and the base parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import qr

from urdyn.identify.map_estimate import Compressed
from urdyn.model.arm import Arm
from urdyn.model.drive import LINEAR
from urdyn.model.moments import generic_moments
from urdyn.types import Array

TOLERANCE = 1e-7  # relative to the largest singular value of unit columns: far above rounding
CORE = ("rotor_inertia", "coulomb", "viscous", "offset")  # terms that every joint has


def data_rank(blocks: Sequence[Compressed], joints: int) -> tuple[int, int]:
    """Rank and number of columns of the problem in link inertials and every joint's core terms."""
    n = 10 * joints + len(CORE) * joints
    rows = []
    for block in blocks:
        rigid = 10 * (joints - block.joint)
        wide = np.zeros((len(block.R), n))
        wide[:, 10 * block.joint : 10 * joints] = block.R[:, :rigid]
        start = 10 * joints + len(CORE) * block.joint
        picked = [rigid + LINEAR.index(name) for name in CORE]
        wide[:, start : start + len(CORE)] = block.R[:, picked]
        rows.append(wide)
    A = np.vstack(rows)
    norms = np.linalg.norm(A, axis=0)
    nonzero = norms > TOLERANCE * norms.max()  # a column of rounding errors does not count
    singular = np.linalg.svd(A[:, nonzero] / norms[nonzero], compute_uv=False)
    return int(np.sum(singular > TOLERANCE * singular[0])), n


def base_parameters(arm: Arm, rng: np.random.Generator, samples: int = 200) -> tuple[Array, Array]:
    """Inertials identifiable on a fixed base, and the base parameters. [Gautier1991]_

    Returns:
        Indices (B,) of independent columns of the regressor, and the (B, 10 J) matrix that maps
        all inertials to the base parameters: Y pi = Y[:, indices] (matrix pi) for every motion.
    """
    Y = arm.regressor(*generic_moments(arm, rng, samples)).reshape(-1, 10 * arm.joints)
    R, pivots = qr(Y, mode="r", pivoting=True)
    scale = np.abs(np.diag(R))
    rank = int(np.sum(scale > TOLERANCE * scale[0]))
    independent = np.sort(pivots[:rank])
    matrix = np.linalg.lstsq(Y[:, independent], Y, rcond=None)[0]
    return independent, np.where(np.abs(matrix) > 1e-9, matrix, 0.0)
