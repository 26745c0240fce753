"""What motion can show of an arm's bodies at best."""

from __future__ import annotations

import numpy as np

from urdyn.model.consistency import log_cholesky, log_cholesky_jacobian
from urdyn.model.dynamics import Dynamics
from urdyn.model.moments import generic_moments
from urdyn.model.population import Population
from urdyn.types import Array

SHOWN = 1e-6  # of the largest singular value, from which on a direction is tracked


def shown_directions(
    population: Population, reference: Dynamics, rng: np.random.Generator | None = None
) -> tuple[Array, Array]:
    """What motion can show of a population's inertials.

    Args:
        rng: of the generic moments.

    Returns:
        V, (10 J, r): orthonormal directions among the links' standard scores; and S V, (10 J, r):
            the inertials per unit of each.
    """
    arm = reference.arm
    J = log_cholesky_jacobian(log_cholesky(reference.inertials))  # at the fit's estimate
    S = np.zeros((10 * arm.joints, 10 * arm.joints))
    for j in range(arm.joints):
        rows = slice(10 * j, 10 * j + 10)
        S[rows, rows] = J[j] * population.link_sd[j]
    Y = arm.regressor(*generic_moments(arm, rng)).reshape(-1, 10 * arm.joints) @ S
    _, singular, Vt = np.linalg.svd(Y, full_matrices=False)
    V = Vt[singular > SHOWN * singular[0]].T
    return V, S @ V
