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

import numpy as np

from urdyn.model.consistency import from_pseudo_inertia, pseudo_inertia
from urdyn.types import Array, Gaussian

PROJECTIONS = 40  # at most
SLACK = 1e-6  # [-] of the largest entry, that counts as rounding
_BASIS = pseudo_inertia(np.eye(10))  # (10, 4, 4) of a unit of each inertial


def possible_body(belief: Gaussian, reach: float) -> Array:
    """Inertials (10,), in Pinocchio's order, of a body within `reach` [m] of its frame."""
    body = belief.mean
    for _ in range(PROJECTIONS):
        normal = _broken(body, reach)
        if normal is None:
            break
        toward = belief.cov @ normal
        body = body - (normal @ body) / (normal @ toward) * toward
    return _mended(body, reach)


def _broken(inertials: Array, reach: float) -> Array | None:
    """The half-space, as its normal (10,), that inertials break most; None: they are possible."""
    J = pseudo_inertia(inertials)
    # In units in which a body of this reach has entries of one size.
    unit = np.diag([1.0 / reach] * 3 + [1.0])
    value, vector = np.linalg.eigh(unit @ J @ unit)
    beyond = float(np.trace(J[:3, :3]) / reach**2 - J[3, 3])
    slack = SLACK * float(np.abs(value).max())
    if value[0] >= -slack and beyond <= slack:
        return None
    if -value[0] >= beyond:
        w = unit @ vector[:, 0]
        return _normal(np.outer(w, w))
    return _normal(np.diag([-1.0 / reach**2] * 3 + [1.0]))


def _normal(W: Array) -> Array:
    """n with n · inertials = tr(W J), (10,)."""
    return np.asarray(np.tensordot(_BASIS, W, axes=2))


def _mended(inertials: Array, reach: float) -> Array:
    """The body beside inertials that are one but for what projections left over."""
    value, vector = np.linalg.eigh(pseudo_inertia(inertials))
    J = (vector * np.maximum(value, SLACK * max(value[-1], 0.0))) @ vector.T
    J[3, 3] = max(J[3, 3], np.trace(J[:3, :3]) / reach**2)
    return from_pseudo_inertia(J)
