"""The batch least-squares identifier: maximum a posteriori by CasADi and IPOPT.

    min_z  1/2 sum_b |R_b w_b(z) - r_b|^2  +  sum_k rho_k(z_k)

[R r]_b is the whitened, weighted, QR-compressed data of one joint under one payload; w_b(z) are the
physical unknowns that its columns multiply, over the drive's gain. Log-Cholesky inertias and
logarithms need no constraint; friction that builds up with speed does, f + g >= 0, because
friction never drives a joint.

The prior rho is 1/2 z^2, but for quantities that may be quite unlike the population's it is
Student's: for a group of n scores (nu + n)/2 log(1 + |z|^2/(nu + n)), as wide where data agree with
it, and yielding where they do not [Lange1989]_. The last link contains what is mounted there: a
Gaussian would spread a tool over other links, and distort the drive gains. And in all drives of
the population friction grows with the load. Where it does not, which a logarithm cannot express, a
Gaussian would keep half of the expected value and bias Coulomb friction by the rest. That prior
yields only below zero: an unloaded joint would get tens of times the expected value, to explain
whatever its other friction leaves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from urdyn.errors import IdentifiabilityError
from urdyn.identify.expressions import Quantities, quantities
from urdyn.identify.unknowns import Contradictable, Unknowns
from urdyn.model.drive import LINEAR, STEPS
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Gaussian

FREEDOM = 3.0  # [-] nu of Student's priors: the heaviest tails with finite variance
IPOPT: dict[str, Any] = {
    "ipopt.print_level": 0,
    "print_time": False,
    "show_eval_warnings": False,  # IPOPT shortens a step that is too long
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-9,
}

Place = tuple[int, int | None]  # a joint, and the index of the payload that it carries, if any


@dataclass(frozen=True, eq=False)
class Compressed:
    """Data of one joint under one payload."""

    joint: int
    payload: int | None  # index among the unknowns' payloads; None: the bare arm
    R: Array  # (n, n + 1) upper triangular [columns | current], rows of unit noise


@dataclass(frozen=True, eq=False)
class Problem:
    """The problem, built before it is solved so that it can be inspected."""

    unknowns: Unknowns
    residual: Any  # CasADi function (z, data) -> whitened residuals of all blocks
    at_rest: Any  # CasADi function z -> Coulomb and Stribeck friction at rest, (J,) [N·m], >= 0
    student_t: tuple[Contradictable, ...] = ()  # groups with a Student prior
    data: Array = field(default_factory=lambda: np.zeros(0))  # the point's shape, and all [R r]


def build_problem(unknowns: Unknowns, blocks: Sequence[Compressed], point: Dynamics) -> Problem:
    """The problem of compressed data whose columns were taken at `point`."""
    places = tuple((block.joint, block.payload) for block in blocks)
    data = [shape_of(point), *(block.R for block in blocks)]
    residual = _residual(unknowns, places, tuple(part.shape for part in data))
    flat = np.concatenate([part.ravel("F") for part in data])
    return Problem(unknowns, residual, _at_rest(unknowns), unknowns.contradictable, flat)


# CasADi takes longer to differentiate an expression than to find its maximum. So expressions are
# built once, and what changes from round to round, data and point, enters as parameters.


@lru_cache(maxsize=2)
def _residual(
    unknowns: Unknowns, places: tuple[Place, ...], sizes: tuple[tuple[int, int], ...]
) -> Any:
    """CasADi function (z, data) -> whitened residuals of blocks; data: matrices of `sizes`."""
    edges = np.cumsum([0, *map(math.prod, sizes)]).tolist()
    z, data = ca.MX.sym("z", len(unknowns.mean)), ca.MX.sym("data", edges[-1])
    parts = zip(ca.vertsplit(data, edges), sizes, strict=True)
    shape, *matrices = (ca.reshape(part, *size) for part, size in parts)
    columns = np.cumsum([0, *(width - 1 for _, width in sizes[1:])]).tolist()
    ws = ca.vertsplit(_coefficients(unknowns, places)(z, shape), columns)
    rows = [R[:, :-1] @ w - R[:, -1] for R, w in zip(matrices, ws, strict=True)]
    return ca.Function("residual", [z, data], [ca.vertcat(*rows)])


@lru_cache(maxsize=2)
def _at_rest(unknowns: Unknowns) -> Any:
    z = ca.SX.sym("z", len(unknowns.mean))
    drive = quantities(unknowns, z).drive
    return ca.Function("at_rest", [z], [drive["coulomb"] + drive["stribeck"]])


def shape_of(point: Dynamics) -> Array:
    """Shape parameters, in which a design's columns are not linear, (J, len(STEPS))."""
    each = [getattr(point.drive, name) for name in STEPS]
    return np.stack(np.broadcast_arrays(*each), axis=1)


def coefficient_roots(
    unknowns: Unknowns, places: Sequence[Place], point: Dynamics, belief: Gaussian
) -> list[Array]:
    """L of the coefficients of every (joint, payload), with covariance L Lᵀ, by a belief in z.

    With J their Jacobian and S Sᵀ the covariance of scores, Lᵀ is the triangle of (J S)ᵀ.
    """
    S = np.linalg.cholesky(belief.cov)
    slopes = [linearised(unknowns, [place], point, belief.mean)[1] for place in places]
    return [np.asarray(np.linalg.qr((J @ S).T, mode="r")).T for J in slopes]


def linearised(
    unknowns: Unknowns, places: Sequence[Place], point: Dynamics, z: Array
) -> tuple[Array, Array]:
    """Coefficients w of every (joint, payload), end to end, and dw/dz, at scores z."""
    w, slope = _slope(unknowns, tuple(places))(z, shape_of(point))
    return np.asarray(w).ravel(), np.asarray(slope)


@lru_cache(maxsize=32)
def _slope(unknowns: Unknowns, places: tuple[Place, ...]) -> Any:
    """CasADi function (z, shape) -> w, dw/dz."""
    z, shape = _symbols(unknowns)
    w = _coefficients(unknowns, places)(z, shape)
    return ca.Function("slope", [z, shape], [w, ca.jacobian(w, z)])


@lru_cache(maxsize=32)
def _coefficients(unknowns: Unknowns, places: tuple[Place, ...]) -> Any:
    """CasADi function (z, shape) -> w of every (joint, payload), in the order of columns."""
    z, shape = _symbols(unknowns)
    found = quantities(unknowns, z)
    ws = [_of_joint(found, joint, payload, shape[joint, :]) for joint, payload in places]
    return ca.Function("coefficients", [z, shape], [ca.vertcat(*ws)])


def _symbols(unknowns: Unknowns) -> tuple[Any, Any]:
    """Symbols of the scores, and of the shape of a point."""
    joints = unknowns.prior.arm.joints
    return ca.SX.sym("z", len(unknowns.mean)), ca.SX.sym("shape", joints, len(STEPS))


def _of_joint(found: Quantities, joint: int, payload: int | None, at: Any) -> Any:
    links, drive = found.inertials, found.drive
    borne = ca.DM(found.tool)
    if payload is not None:
        borne = borne + found.payloads[:, payload]
    links = ca.horzcat(links[:, :-1], links[:, -1] + borne)
    distance, tail, velocity, time = ca.horzsplit(at)
    steps = [
        ca.log(drive["presliding_distance"][joint] / distance),
        drive["presliding_tail"][joint] - tail,
        ca.log(drive["stribeck_velocity"][joint] / velocity),
        found.time_offset - time,
    ]
    w = ca.vertcat(ca.vec(links[:, joint:]), *[drive[name][joint] for name in LINEAR], *steps)
    return w / drive["gain"][joint]


def solve(problem: Problem, start: Array) -> Array:
    """Scores z of the posterior's maximum, (P,).

    Raises:
        IdentifiabilityError: the optimiser found no maximum.
    """
    solver = _solver(problem.residual, problem.at_rest, problem.student_t)
    found = solver(x0=start, p=problem.data, lbg=0.0)
    if not solver.stats()["success"]:
        raise IdentifiabilityError(
            f"the identification did not converge ({solver.stats()['return_status']}); "
            "check the units and columns of the log"
        )
    return np.asarray(found["x"]).ravel()


@lru_cache(maxsize=2)
def _solver(residual: Any, at_rest: Any, student_t: tuple[Contradictable, ...]) -> Any:
    """IPOPT for a problem with these equations, for any data."""
    z, data = residual.mx_in()
    cost = 0.5 * ca.sumsqr(residual(z, data)) + _neg_log_prior(z, student_t)
    problems = {"x": z, "p": data, "f": cost, "g": at_rest(z)}
    return ca.nlpsol("maximum", "ipopt", problems, IPOPT)


def _neg_log_prior(z: Any, student_t: tuple[Contradictable, ...]) -> Any:
    """-log p(z) up to a constant, in CasADi: standard normal, or Student's t."""
    twice = ca.sumsqr(z)
    for group in student_t:
        off = z[list(group.scores)]
        square = ca.sumsqr(ca.fmin(off, 0.0) if group.below else off)
        width = FREEDOM + len(group.scores)
        twice += width * ca.log(1.0 + square / width) - square
    return 0.5 * twice


def posterior(problem: Problem, z: Array) -> Gaussian:
    """Laplace's approximation at the maximum, in scores: information is data plus prior."""
    whole = data_information(problem, z) + np.diag(prior_information(problem.student_t, z))
    return Gaussian(z, np.asarray(np.linalg.inv(whole), dtype=np.float64))


def prior_information(student_t: tuple[Contradictable, ...], z: Array) -> Array:
    """The prior's information on scores at `z`, (P,): Student's as an equally strong Gaussian."""
    known = np.ones_like(z)
    for group in student_t:
        at = list(group.scores)
        off = np.minimum(z[at], 0.0) if group.below else z[at]
        known[at] = 1.0 / (1.0 + off @ off / (FREEDOM + len(at)))
    return known


def data_information(problem: Problem, z: Array) -> Array:
    """Information of the data alone on the scores at `z`, (P, P)."""
    J: Array = np.asarray(_residual_slope(problem.residual)(z, problem.data), dtype=np.float64)
    return np.asarray(J.T @ J)


@lru_cache(maxsize=2)
def _residual_slope(residual: Any) -> Any:
    """CasADi function (z, data) -> derivative of the residuals in z."""
    z, data = residual.mx_in()
    return ca.Function("residual_slope", [z, data], [ca.jacobian(residual(z, data), z)])
