"""The batch least-squares identifier: maximum a posteriori by CasADi and IPOPT.

    min_z  1/2 sum_b |R_b w_b(z) - r_b|^2  +  sum_k rho_k(z_k)

[R r]_b is the whitened, weighted, QR-compressed data of one joint under one payload; w_b(z) are the
physical unknowns that its columns multiply, over the drive's gain. Log-Cholesky inertias and
logarithms need no constraint; friction that builds up with speed does, f + g >= 0, for at no speed
does friction drive a joint.

The prior rho is 1/2 z^2, but of structural damping Student's, TAIL^2/2 log(1 + z^2/TAIL^2): as wide
where data agree with it, and giving way where they do not [Lange1989]_. In all drives of the
population friction grows with the load. Where it does not, of which no logarithm tells, a Gaussian
would take half of what it expects for true, and have the rest in Coulomb friction, surely wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from urdyn.errors import IdentifiabilityError
from urdyn.identify.expressions import Quantities, quantities
from urdyn.identify.unknowns import Unknowns
from urdyn.model.drive import LINEAR, STEPS
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Gaussian

TAIL = 2.0  # [-] standard scores at which the prior of structural damping pulls half as much
IPOPT: dict[str, Any] = {
    "ipopt.print_level": 0,
    "print_time": False,
    "show_eval_warnings": False,  # IPOPT takes back a step that is too long
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-9,
}


@dataclass(frozen=True)
class Compressed:
    """Data of one joint under one payload."""

    joint: int
    payload: int | None  # index among the unknowns' payloads; None: the bare arm
    R: Array  # (n, n + 1) upper triangular [columns | current], rows of unit noise


@dataclass(frozen=True)
class Problem:
    """Built before it is solved, so that it can be looked at."""

    unknowns: Unknowns
    residual: Any  # CasADi function z -> whitened residuals of all blocks
    at_rest: Any  # CasADi function z -> Coulomb and Stribeck friction at rest, (J,) [N·m], >= 0
    student_t: list[int] = field(default_factory=list)  # scores whose prior has Student's tails


def build_problem(unknowns: Unknowns, blocks: Sequence[Compressed], point: Dynamics) -> Problem:
    """The problem of compressed data whose columns were taken at `point`."""
    z = ca.MX.sym("z", len(unknowns.mean))
    ws = coefficients(unknowns, [(b.joint, b.payload) for b in blocks], point)(z)
    rows = [
        ca.DM(block.R[:, :-1]) @ w - ca.DM(block.R[:, -1])
        for block, w in zip(blocks, ca.vertsplit(ws, _edges(blocks)), strict=True)
    ]
    residual = ca.Function("residual", [z], [ca.vertcat(*rows)])
    return Problem(unknowns, residual, _at_rest(unknowns), unknowns.structural)


def _at_rest(unknowns: Unknowns) -> Any:
    z = ca.SX.sym("z", len(unknowns.mean))
    drive = quantities(unknowns, z).drive
    return ca.Function("at_rest", [z], [drive["coulomb"] + drive["stribeck"]])


def coefficient_covs(
    unknowns: Unknowns, places: Sequence[tuple[int, int | None]], point: Dynamics, belief: Gaussian
) -> list[Array]:
    """Covariance of the coefficients of every (joint, payload), by a belief in scores."""
    z = ca.MX.sym("z", len(belief.mean))
    ws = [coefficients(unknowns, [place], point)(z) for place in places]
    slopes = ca.Function("slopes", [z], [ca.jacobian(w, z) for w in ws])(belief.mean)
    return [J @ belief.cov @ J.T for J in map(np.asarray, slopes)]


def _edges(blocks: Sequence[Compressed]) -> list[int]:
    return [0, *np.cumsum([block.R.shape[1] - 1 for block in blocks]).tolist()]


def coefficients(
    unknowns: Unknowns, places: Sequence[tuple[int, int | None]], point: Dynamics
) -> Any:
    """CasADi function z -> w of every (joint, payload), end to end, in the order of columns."""
    z = ca.SX.sym("z", len(unknowns.mean))
    found = quantities(unknowns, z)
    ws = [_coefficients(found, joint, payload, point) for joint, payload in places]
    return ca.Function("coefficients", [z], [ca.vertcat(*ws)])


def _coefficients(found: Quantities, joint: int, payload: int | None, point: Dynamics) -> Any:
    links, at, drive = found.inertials, point.drive, found.drive
    borne = ca.DM(found.tool)
    if payload is not None:
        borne = borne + found.payloads[:, payload]
    links = ca.horzcat(links[:, :-1], links[:, -1] + borne)
    steps = [
        ca.log(drive["presliding_distance"][joint] / at.presliding_distance[joint]),
        drive["presliding_tail"][joint] - at.presliding_tail[joint],
        ca.log(drive["stribeck_velocity"][joint] / at.stribeck_velocity[joint]),
        found.time_offset - at.time_offset,
    ]
    assert len(steps) == len(STEPS), "one step for every column of a design that has one"
    w = ca.vertcat(ca.vec(links[:, joint:]), *[drive[name][joint] for name in LINEAR], *steps)
    return w / drive["gain"][joint]


def solve(problem: Problem, start: Array) -> Array:
    """Scores z of the posterior's maximum, (P,).

    Raises:
        IdentifiabilityError: the optimiser found no maximum.
    """
    z: Any = ca.MX.sym("z", len(start))
    cost: Any = 0.5 * ca.sumsqr(problem.residual(z)) + _neg_log_prior(z, problem.student_t)
    problems = {"x": z, "f": cost, "g": problem.at_rest(z)}
    solver = ca.nlpsol("maximum", "ipopt", problems, IPOPT)
    found = solver(x0=start, lbg=0.0)
    if not solver.stats()["success"]:
        raise IdentifiabilityError(
            f"the identification did not converge ({solver.stats()['return_status']}); "
            "check the units and columns of the log"
        )
    return np.asarray(found["x"]).ravel()


def _neg_log_prior(z: Any, student_t: list[int]) -> Any:
    """-log p(z) but for a constant, CasADi: standard normal, or Student's t."""
    tailed = z[student_t]
    wide = TAIL**2 * ca.sum1(ca.log(1.0 + (tailed / TAIL) ** 2))
    return 0.5 * (ca.sumsqr(z) - ca.sumsqr(tailed) + wide)


def posterior(problem: Problem, z: Array) -> Gaussian:
    """Laplace's approximation at the maximum, in scores: information is data plus prior.

    Student's prior counts as the Gaussian that pulls as much there.
    """
    at, prior = problem.student_t, np.ones_like(z)
    prior[at] = 1.0 / (1.0 + (z[at] / TAIL) ** 2)
    whole = data_information(problem, z) + np.diag(prior)
    return Gaussian(z, np.asarray(np.linalg.inv(whole), dtype=np.float64))


def data_information(problem: Problem, z: Array) -> Array:
    """What the data alone say of the scores at `z`, (P, P)."""
    symbol = ca.MX.sym("z", len(z))
    slope = ca.Function("slope", [symbol], [ca.jacobian(problem.residual(symbol), symbol)])
    J: Array = np.asarray(slope(z), dtype=np.float64)
    return np.asarray(J.T @ J)
