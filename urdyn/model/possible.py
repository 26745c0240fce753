"""The possible body that is nearest to a belief about its inertials.

A filter that is linear in a body's inertials allows negative masses too. The bodies that can
exist, within some reach R of their frame, are those whose pseudo-inertia J (see `consistency`) has

    w' J w >= 0 for every w,        R² m - tr(Sigma) >= 0:  ∫ |r|² dm <= R² m

each a half-space of the inertials, and together a convex cone at whose tip nothing is carried. The
likeliest body within is found by cutting planes [Kelley1960]_: violated half-spaces are collected,
and the belief is projected, in its own metric, onto their intersection. The covariance stays as it
was: a Gaussian truncated at the edge of the cone would be overconfident, above all that something
is carried at all.

Mass and first moments alone are those of some body if and only if |h| <= R m, a round cone, and
the likeliest within has the form of a trust region's step [More1983]_: one equation of one unknown.
"""

from __future__ import annotations

from functools import lru_cache
from math import hypot, sqrt

import numpy as np

from urdyn.model.consistency import from_pseudo_inertia, pseudo_inertia
from urdyn.types import Array, Gaussian, frozen

CUTS = 40  # at most
SLACK = 1e-6  # [-] of the largest entry: less counts as rounding
FINE = 1e-2  # [sd] of a cut, below which it is negligible
ROUNDING = 1e-9  # [-] by which two cuts differ at least
SURE = 1e-30  # [kg²] least variance of a load: that of rounding 5 kg
FLAT = 1e-12  # [-] least variance of a load, of its largest
EXACT = 1e-12  # [-] by which an equation's sides may differ
STEPS = 60  # of Newton's method, at most; it takes 5, unless hardly anything is carried
CONE = frozen(np.array([1.0, -1.0, -1.0, -1.0]))
WITHIN = frozen(np.diag([-1.0, -1.0, -1.0, 1.0]).ravel())  # @ J, in units of the reach


def possible_body(belief: Gaussian, reach: float) -> Array:
    """Inertials (10,), in Pinocchio's order, of a body within `reach` [m] of its frame."""
    body, of_reach, cuts = belief.mean, _of_reach(reach), np.zeros((0, 10))
    for _ in range(CUTS):
        normal = _broken(body, of_reach)
        if normal is None or -(normal @ body) < FINE * float(normal @ belief.cov @ normal) ** 0.5:
            break
        body, cuts = _within(belief, np.concatenate([cuts, normal[None]]))
    return _mended(body, reach)


def possible_load(belief: Gaussian, reach: float) -> Array:
    """Mass and first moments (4,) of a body within `reach` [m] of its frame.

    With lambda the multiplier of the cone's edge and C = diag(1, -1, -1, -1) in units of the
    reach, it is (P^-1 - lambda C)^-1 P^-1 mean, on the edge. In coordinates in which P is 1 and C
    is diag(-d, d0), with the mean (o, o0), that is w = o / (1 + lambda d) and d0 w0² = d w².
    A belief without variance, such as a cloud of equal particles, yields alike in all of it.
    """
    unit = np.array([1.0, *[1.0 / reach] * 3])
    variance, axes = np.linalg.eigh(belief.cov * unit[:, None] * unit)
    sd = np.sqrt(np.maximum(variance, max(FLAT * variance[-1], SURE)))
    root = axes * sd
    d, turned = np.linalg.eigh(root.T @ (CONE[:, None] * root))
    back = (root @ turned) / unit[:, None]  # @ coordinates: mass and moments
    *o, o0 = (turned.T @ ((axes.T @ (unit * belief.mean)) / sd)).tolist()
    *d, d0 = np.abs(d).tolist()
    up = 1.0 if back[0, -1] > 0.0 else -1.0
    known, apart = up * o0 * sqrt(d0), [abs(x) * sqrt(y) for x, y in zip(o, d, strict=True)]
    narrow = [x / d0 for x in d]
    if known >= hypot(*apart):
        return belief.mean
    if -known >= hypot(*(x / y for x, y in zip(apart, narrow, strict=True))):
        return np.zeros(4)
    cost = 1.0 - _share(known, apart, narrow)  # lambda d0
    w = [x / (1.0 + cost * y) for x, y in zip(o, narrow, strict=True)]
    w0 = up * hypot(*(x * sqrt(y) for x, y in zip(w, narrow, strict=True)))
    load = back @ [*w, w0]
    load[0] = max(load[0], float(np.linalg.norm(load[1:])) / reach)  # corrects rounding
    return np.asarray(load)


def _share(known: float, apart: list[float], narrow: list[float]) -> float:
    """s at which |apart / (1 + narrow (1 - s))| s = known: of its sign and below 1.

    As a function of 1 / s the left side is convex: Newton's steps go one way, and never overshoot.
    """
    if known == 0.0:
        return 0.0
    t, ahead = (1.0, 1.0) if known > 0.0 else (0.0, -1.0)
    for _ in range(STEPS):
        sides = [ahead * (t + k * (t - 1.0)) for k in narrow]
        parts = [x / y for x, y in zip(apart, sides, strict=True)]
        whole = hypot(*parts)
        if whole <= (1.0 + EXACT) * abs(known):
            break
        fall = sum(p * p * (1.0 + k) / y for p, y, k in zip(parts, sides, narrow, strict=True))
        t += ahead * (whole - abs(known)) * whole / fall
    return 1.0 / t if t else -np.inf


@lru_cache(maxsize=8)
def _of_reach(reach: float) -> Array:
    """Pseudo-inertias of a unit of each inertial, (10, 16), a row each.

    In units in which a body of this reach has entries of one size.
    """
    unit = np.array([1.0 / reach] * 3 + [1.0])
    return frozen((pseudo_inertia(np.eye(10)) * unit[:, None] * unit).reshape(10, 16))


def _within(belief: Gaussian, cuts: Array) -> tuple[Array, Array]:
    """The likeliest point (10,) on the right side of cuts (k, 10), and the active cuts."""
    while len(cuts):
        toward = cuts @ belief.cov
        G = toward @ cuts.T
        G.flat[:: len(G) + 1] *= 1.0 + ROUNDING
        push = np.linalg.solve(G, -(cuts @ belief.mean))
        least = push.argmin()
        if push[least] >= 0.0:
            return belief.mean + push @ toward, cuts
        cuts = cuts[np.arange(len(cuts)) != least]
    return belief.mean, cuts


def _broken(inertials: Array, of_reach: Array) -> Array | None:
    """The half-space, by its normal (10,), that inertials violate most; None: they are possible."""
    J = inertials @ of_reach
    value, vector = np.linalg.eigh(J.reshape(4, 4))
    beyond = -float(J @ WITHIN)
    below, w = -float(value[0]), vector[:, 0]
    slack = SLACK * max(below, float(value[3]))
    if below <= slack and beyond <= slack:
        return None
    return np.asarray(of_reach @ ((w[:, None] * w).ravel() if below >= beyond else WITHIN))


def _mended(inertials: Array, reach: float) -> Array:
    """The body next to inertials that are one up to the projections' remainders."""
    value, vector = np.linalg.eigh(pseudo_inertia(inertials))
    J = (vector * np.maximum(value, SLACK * max(value[-1], 0.0))) @ vector.T
    J[3, 3] = max(J[3, 3], np.trace(J[:3, :3]) / reach**2)
    return from_pseudo_inertia(J)
