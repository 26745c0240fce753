"""The body that is nearest to a belief in one.

A filter that is linear in a body's inertials believes in negative masses too. The bodies that
exist, within some reach R of their frame, are those whose pseudo-inertia J (see `consistency`) has

    w' J w >= 0 for every w,        R² m - tr(Sigma) >= 0:  ∫ |r|² dm <= R² m

each a half-space of the inertials, and together a convex cone at whose tip nothing is carried. The
likeliest body within is found by projection, in the belief's own metric, upon one broken half-space
after the other [Dykstra1983]_. How sure the belief is stays as it was: at the edge of the cone a
Gaussian that is cut would be too sure, above all that something is carried at all.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from urdyn.model.consistency import from_pseudo_inertia, pseudo_inertia
from urdyn.types import Array, Gaussian

PROJECTIONS = 40  # at most
SLACK = 1e-6  # [-] of the largest entry, that counts as rounding


def possible_body(belief: Gaussian, reach: float) -> Array:
    """Inertials (10,), in Pinocchio's order, of a body within `reach` [m] of its frame."""
    body, (forms, within) = belief.mean, _half_spaces(reach)
    for _ in range(PROJECTIONS):
        normal = _broken(body, forms, within)
        if normal is None:
            break
        toward = belief.cov @ normal
        body = body - (normal @ body) / (normal @ toward) * toward
    return _mended(body, reach)


@lru_cache
def _half_spaces(reach: float) -> tuple[Array, Array]:
    """J of a unit of each inertial, (10, 16), in units in which a body of this reach has entries
    of one size; and the normal (10,) of the half-space of what is within reach.
    """
    unit = np.diag([1.0 / reach] * 3 + [1.0])
    J = unit @ pseudo_inertia(np.eye(10)) @ unit
    return J.reshape(10, 16), 2.0 * J[:, 3, 3] - np.trace(J, axis1=1, axis2=2)


def _broken(inertials: Array, forms: Array, within: Array) -> Array | None:
    """The half-space, as its normal (10,), that inertials break most; None: they are possible."""
    value, vector = np.linalg.eigh((inertials @ forms).reshape(4, 4))
    least, most, beyond = float(value[0]), float(value[3]), -float(within @ inertials)
    slack = SLACK * max(-least, most)
    if least >= -slack and beyond <= slack:
        return None
    if -least < beyond:
        return within
    w = vector[:, 0]
    return np.asarray(forms @ (w[:, None] * w).ravel())


def _mended(inertials: Array, reach: float) -> Array:
    """The body beside inertials that are one but for what projections left over."""
    value, vector = np.linalg.eigh(pseudo_inertia(inertials))
    J = (vector * np.maximum(value, SLACK * max(value[-1], 0.0))) @ vector.T
    J[3, 3] = max(J[3, 3], np.trace(J[:3, :3]) / reach**2)
    return from_pseudo_inertia(J)
