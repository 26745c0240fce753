"""What the tool carries, moment by moment: workpieces that come and go are no fault.

The payload's ten inertials are tracked as modes: the commissioned one, and each other one met. A
moment is assigned to the mode that explains it best; a new mode is made where none does and a
payload explains it better than any fault of a joint.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from urdyn.diagnose.residual.moment import Pool
from urdyn.tracking.belief.model import PAYLOAD_SD
from urdyn.tracking.belief.physical import PAYLOAD_REACH
from urdyn.types import Array, Index

ANYTHING = PAYLOAD_SD  # sd of a new one
PRIOR = np.diag(ANYTHING**-2.0)  # the same as information
NOTHING = np.array([0.02, 0.004, 0.004, 0.004, *[5e-4] * 6])  # sd that a cable adds to a known one
ALIKE = np.array([0.15, 0.03, 0.03, 0.03, *[0.01] * 6])  # -, m, m²: sd per kilogram of another
SURE = 12.0  # [nats] by which a new mode must be better than the known ones
CHANGED = 3.0  # [nats] log of the moments for which a piece is held, or not
MODES = 4  # that are kept


@dataclass(frozen=True, eq=False)
class Mode:
    """A load that is carried."""

    mean: Array  # (10,) inertials in addition to the commissioned payload
    cov: Array  # (10, 10)
    seen: float  # [s] end of its last moment


@dataclass(frozen=True, eq=False)
class Shown:
    """A moment's information about the payload, all other states marginalised.

    log L(m) = c + d' m - m' C m / 2, exact at one load: friction is not linear in it.
    """

    C: Array  # (10, 10)
    d: Array  # (10,)
    c: float = 0.0
    beside: Array = field(default_factory=partial(np.zeros, 10))  # that load


def shown(pool: Pool, at: Index, rest: Index, x: Array, P: Array, beside: Array) -> Shown:
    """Information about the payload, given the belief N(x, P) about the rest.

    Args:
        pool: of moments of an arm that carries `beside`, (10,).
        at: the payload's states.
        rest: the others.
    """
    A, cross = pool.A[np.ix_(rest, rest)], pool.A[np.ix_(rest, at)]
    g, inner = pool.b[rest] - A @ x, lu_factor(np.eye(len(rest)) + A @ P)
    keep = lu_solve(inner, np.column_stack([cross, g]))
    C = pool.A[np.ix_(at, at)] - cross.T @ P @ keep[:, :-1]
    C = 0.5 * (C + C.T)
    d = pool.b[at] - cross.T @ (x + P @ keep[:, -1])
    square = pool.square - (pool.b[rest] + g) @ x - g @ P @ keep[:, -1]
    c = -0.5 * (square + np.sum(np.log(np.abs(np.diag(inner[0])))))
    return Shown(C, d + C @ beside, c - d @ beside - 0.5 * beside @ C @ beside, beside)


def fit(told: Shown, mode: Mode) -> float:
    """Log-likelihood of a moment under a mode, up to a constant."""
    g = told.d - told.C @ mode.mean
    inner = np.eye(10) + told.C @ mode.cov
    base = told.c + told.d @ mode.mean - 0.5 * mode.mean @ told.C @ mode.mean
    gain = 0.5 * g @ mode.cov @ np.linalg.solve(inner, g)
    return float(base + gain - 0.5 * np.linalg.slogdet(inner)[1])


def learnt(told: Shown, mode: Mode, t: float) -> Mode:
    """The mode updated with a moment of it."""
    inner = np.eye(10) + mode.cov @ told.C
    cov = np.linalg.solve(inner, mode.cov)
    mean = mode.mean + cov @ (told.d - told.C @ mode.mean)
    return Mode(mean, 0.5 * (cov + cov.T), t)


def commissioned(t: float = -np.inf) -> Mode:
    """The commissioned payload."""
    return Mode(np.zeros(10), np.diag(NOTHING**2), t)


def anything(t: float) -> Mode:
    """A new, unknown payload."""
    return Mode(np.zeros(10), np.diag(ANYTHING**2), t)


def possible(mode: Mode, payload: Array) -> bool:
    """Whether it is plausible: no body has a negative mass, or hangs far from the flange.

    A disturbance of one joint's current, a bias say, looks like a load without mass, far away.

    Args:
        payload: inertials of the commissioned payload, (10,).
    """
    whole, sd = payload + mode.mean, np.sqrt(np.diag(mode.cov) + NOTHING**2)
    heaviest, moment = whole[0] + 2.0 * sd[0], np.linalg.norm(whole[1:4])
    least = moment - 2.0 * np.linalg.norm(whole[1:4] * sd[1:4]) / max(moment, NOTHING[1])
    return bool(heaviest > 0.0 and least < PAYLOAD_REACH * heaviest)


def spread(mode: Mode) -> Mode:
    """The same with a variance no smaller than a cable's."""
    floor = np.diag(np.maximum(np.diag(mode.cov), NOTHING**2) - np.diag(mode.cov))
    return replace(mode, cov=mode.cov + floor)


def alike(mode: Mode) -> Mode:
    """A piece like this one: the next program's may weigh as much, yet be another."""
    return replace(mode, cov=mode.cov + np.diag((ALIKE * mode.mean[0]) ** 2))


def together(told: Sequence[Shown]) -> Shown:
    """The information in several moments about one payload."""
    C, d = (np.sum([getattr(each, name) for each in told], axis=0) for name in ("C", "d"))
    return Shown(C, d, sum(each.c for each in told))


def nearest(told: Sequence[Shown], m: Array) -> Shown:
    """A moment's information at the known load nearest to m, (10,)."""
    return min(told, key=lambda each: float(unlike(each.beside, m)))


def unlike(loads: Array, m: Array) -> Array:
    """How far loads (..., 10) are from m, (10,), in sd of an unknown one."""
    return np.asarray(np.abs((loads - m) / ANYTHING).max(axis=-1))


def remembered(modes: Sequence[Mode], new: Mode, needed: Set[int]) -> tuple[tuple[Mode, ...], int]:
    """The modes with a new one, and its index; where they are too many it replaces an old one.

    Args:
        needed: modes that may still be carried.
    """
    spare = [k for k in range(1, len(modes)) if k not in needed]
    if len(modes) < MODES or not spare:
        return (*modes, new), len(modes)
    oldest = min(spare, key=lambda k: modes[k].seen)
    return tuple(new if k == oldest else mode for k, mode in enumerate(modes)), oldest
