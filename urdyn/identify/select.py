"""Which optional terms a joint's model needs: those that raise evidence and held-out likelihood.

The marginal likelihood of all data tells a term from chance [Kass1995]_, but not from one that
stands in for another. So held-out current must also be predicted better, with the fit's remaining
uncertainty. The log is cut into contiguous folds, each compressed on its own. Fitting all folds but
one and scoring that one then costs a small solve, whatever the log's length. [Stone1974]_
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify.map_estimate import Compressed, linearised, prior_information
from urdyn.identify.unknowns import Unknowns
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array

CANDIDATES: tuple[tuple[str, ...], ...] = (
    ("stribeck", "stribeck_velocity"),
    ("ripple_cos", "ripple_sin"),
    ("thermal",),
)
MIN_EVIDENCE = 5.0  # nats; exceeded by chance in one of 300 joints without such terms
MIN_GAIN = 3.0  # nats held out; by chance, one of 72 joints without such terms reaches 5


def select_terms(
    unknowns: Unknowns, folds: Sequence[Sequence[Compressed]], point: Dynamics, z: Array
) -> tuple[frozenset[str], ...]:
    """Optional terms of every joint, chosen greedily.

    Args:
        unknowns: a model with all candidate terms.
        folds: compressed data, the same blocks for every fold, in units of the noise.
        point: where the columns were linearised.
        z: scores around which the coefficients are linearised, (P,).
    """
    return tuple(
        _select_joint(unknowns, [[b for b in fold if b.joint == j] for fold in folds], point, z, j)
        for j in range(unknowns.prior.arm.joints)
    )


def _select_joint(
    unknowns: Unknowns, folds: list[list[Compressed]], point: Dynamics, z: Array, joint: int
) -> frozenset[str]:
    systems = [_linear(unknowns, fold, point, z) for fold in folds]
    name = unknowns.prior.arm.joint_names[joint]
    places = {
        group: [unknowns.names.index(f"{name}.{t}") for t in group if unknowns.has(t, joint)]
        for group in CANDIDATES
        if unknowns.has(group[0], joint)
    }
    kept: list[str] = []
    while places:
        group, gain = _best(systems, places)
        if gain <= MIN_GAIN:
            break
        del places[group]
        kept += [term for term in group if term != "stribeck_velocity"]
    return frozenset(kept)


def _best(
    systems: list[tuple[Array, Array]], places: dict[tuple[str, ...], list[int]]
) -> tuple[tuple[str, ...], float]:
    """The omitted group that would help most, and by how many nats.

    The best goes first, because missing warmth looks like friction that fades with speed.
    """
    out = {index for indices in places.values() for index in indices}
    bare = _without(systems, out)
    likely, predicted = _evidence(bare), _held_out(bare)
    gains = {}
    for group, indices in places.items():
        more = _without(systems, out - set(indices))
        surely = _evidence(more) - likely > MIN_EVIDENCE
        gains[group] = _held_out(more) - predicted if surely else -np.inf
    best = max(gains, key=lambda group: gains[group])
    return best, gains[best]


def _linear(
    unknowns: Unknowns, blocks: list[Compressed], point: Dynamics, z: Array
) -> tuple[Array, Array]:
    """A, b of the fold's residual A s - b, in scores s with unit prior information."""
    w, G = linearised(unknowns, [(b.joint, b.payload) for b in blocks], point, z)
    root = np.sqrt(prior_information(unknowns.contradictable, z))
    rows, targets, start = [], [], 0
    for block in blocks:
        R, r = block.R[:, :-1], block.R[:, -1]
        part = slice(start, start + R.shape[1])
        rows.append(R @ G[part] / root)
        targets.append(r - R @ (w[part] - G[part] @ z))
        start = part.stop
    return np.vstack(rows), np.concatenate(targets)


def _without(systems: list[tuple[Array, Array]], out: set[int]) -> list[tuple[Array, Array]]:
    """The systems of a model without the scores in `out`."""
    keep = np.setdiff1d(np.arange(systems[0][0].shape[1]), list(out))
    return [(A[:, keep], b) for A, b in systems]


def _held_out(systems: list[tuple[Array, Array]]) -> float:
    """Predictive log-likelihood of every fold given the others, summed."""
    normal = [(A.T @ A, A.T @ b) for A, b in systems]
    H, g = (np.sum(part, axis=0) for part in zip(*normal, strict=True))
    return sum(_likelihood(H, g) - _likelihood(H - Hk, g - gk) for Hk, gk in normal)


def _evidence(systems: list[tuple[Array, Array]]) -> float:
    """Marginal log-likelihood of all folds, up to a constant."""
    A, b = (np.concatenate(part) for part in zip(*systems, strict=True))
    return _likelihood(A.T @ A, A.T @ b)


def _likelihood(H: Array, g: Array) -> float:
    """Marginal log-likelihood of data with information H and H z = g, up to a constant."""
    known = H + np.eye(len(g))
    return float(0.5 * g @ np.linalg.solve(known, g) - 0.5 * np.linalg.slogdet(known)[1])
