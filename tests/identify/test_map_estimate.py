"""The identifier against dense linear algebra, and against itself by finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.stats import norm

from urdyn.errors import IdentifiabilityError
from urdyn.identify import Noise
from urdyn.identify.compress import compress
from urdyn.identify.expressions import dynamics
from urdyn.identify.map_estimate import (
    FREEDOM,
    Compressed,
    Problem,
    build_problem,
    coefficient_roots,
    data_information,
    posterior,
    solve,
)
from urdyn.identify.unknowns import Contradictable, Unknowns
from urdyn.model.drive import LINEAR
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import OPTIONAL, population
from urdyn.types import Array, Gaussian, Motion

STEP = 1e-5  # of a finite difference in a score
CHANCE = 0.01  # that a test fails although its claim holds
DAMPING = (Contradictable((1,), below=True),)  # of a problem whose second score is one


@pytest.fixture(scope="module")
def blocks(point: Dynamics, motion: Motion, noise: Noise) -> list[Compressed]:
    """The same motion without the payload and with it."""
    rng = np.random.default_rng(6)
    bare = replace(point, payload=np.zeros(10))
    data = []
    for arm, payload in ((bare, None), (point, 0)):
        current = arm.current(motion) + 0.05 * rng.standard_normal(motion.q.shape)
        data += compress(arm, replace(motion, current=current), noise, payload)
    return data


@pytest.fixture(scope="module")
def problem(unknowns: Unknowns, blocks: list[Compressed], point: Dynamics) -> Problem:
    return build_problem(unknowns, blocks, point)


@pytest.fixture(scope="module")
def truth(unknowns: Unknowns, point: Dynamics) -> Array:
    return unknowns.score(point, (point.payload,))


def residual(problem: Problem, z: Array) -> Array:
    return np.asarray(problem.residual(z, problem.data)).ravel()


def assembled(unknowns: Unknowns, blocks: list[Compressed], point: Dynamics, z: Array) -> Array:
    """R w - r of every block, w by NumPy."""
    arm, payloads = dynamics(unknowns, z, 0.0, np.full(6, np.nan))
    at, drive, rows = point.drive, arm.drive, []
    for block in blocks:
        j = block.joint
        links = arm.inertials.copy()
        if block.payload is not None:
            links[-1] += payloads[block.payload]
        steps = [
            np.log(drive.presliding_distance[j] / at.presliding_distance[j]),
            drive.presliding_tail[j] - at.presliding_tail[j],
            np.log(drive.stribeck_velocity[j] / at.stribeck_velocity[j]),
            drive.time_offset - at.time_offset,
        ]
        linear = [getattr(drive, name)[j] for name in LINEAR]
        w = np.concatenate([links[j:].ravel(), linear, steps]) / drive.gain[j]
        rows.append(block.R[:, :-1] @ w - block.R[:, -1])
    return np.concatenate(rows)


def function(z: Any, rows: Any) -> Any:
    """CasADi's, of a residual that takes no data."""
    return ca.Function("residual", [z, ca.MX.sym("data", 0)], [rows])


def slope(problem: Problem, z: Array) -> Array:
    """Jacobian of the residual by central differences."""
    moves = STEP * np.eye(len(z))
    up, down = (np.array([residual(problem, z + s * h) for h in moves]) for s in (1, -1))
    return (up - down).T / (2.0 * STEP)


def insistence(problem: Problem, z: Array) -> Array:
    """How much of a Gaussian prior's pull there is, score by score."""
    pull = np.ones(len(z))
    for group in problem.student_t:
        at = list(group.scores)
        off = np.where(group.below & (z[at] > 0.0), 0.0, z[at])
        pull[at] = 1.0 / (1.0 + np.sum(off**2) / (FREEDOM + len(at)))
    return pull


def test_the_residual_is_what_numpy_makes_of_it(
    problem: Problem, blocks: list[Compressed], point: Dynamics, truth: Array
) -> None:
    near = truth + 0.1 * np.random.default_rng(0).standard_normal(len(truth))
    wanted = assembled(problem.unknowns, blocks, point, near)
    rounding = 1e-12 * max(np.abs(block.R).sum() for block in blocks)
    np.testing.assert_allclose(residual(problem, near), wanted, rtol=0, atol=rounding)


def test_nothing_pulls_at_the_maximum(problem: Problem, truth: Array) -> None:
    """Newton's step from the solution is a vanishing share of a standard deviation."""
    z = solve(problem, truth)
    belief = posterior(problem, z)
    gradient = slope(problem, z).T @ residual(problem, z) + insistence(problem, z) * z
    assert np.sqrt(gradient @ belief.cov @ gradient) < 1e-3


def test_the_maximum_is_found_from_afar(problem: Problem, truth: Array) -> None:
    near, far = solve(problem, truth), solve(problem, np.zeros(len(truth)))
    sd = posterior(problem, near).sd
    assert np.abs((far - near) / sd).max() < 1e-3


def test_friction_at_rest_is_never_below_zero(problem: Problem, unknowns: Unknowns) -> None:
    z = ca.MX.sym("z", len(unknowns.mean))
    name = f"{unknowns.prior.arm.joint_names[1]}.stribeck"
    pull = 1e3 * (z[unknowns.names.index(name)] + 50.0)  # data that ask for fifty sd below
    pulled = Problem(unknowns, function(z, pull), problem.at_rest)
    found = np.array(problem.at_rest(solve(pulled, np.zeros(len(unknowns.mean))))).ravel()
    assert found.min() > -1e-6 and found.argmin() == 1


def test_information_is_that_of_the_data_and_of_the_prior(problem: Problem, truth: Array) -> None:
    J = slope(problem, truth)
    wanted = np.linalg.inv(J.T @ J + np.diag(insistence(problem, truth)))
    belief = posterior(problem, truth)
    sd = np.sqrt(np.diag(wanted))
    # Rounding of residuals over STEP, in units of the noise, against an information of 1 or more.
    largest = np.abs(J).max()
    relative = np.finfo(float).eps * np.abs(J).sum(axis=1).max() / STEP + STEP**2 * largest
    np.testing.assert_allclose(
        belief.cov / np.outer(sd, sd), wanted / np.outer(sd, sd), rtol=0, atol=10.0 * relative
    )


def unbound(count: int) -> Any:
    """No friction that has to stay above zero."""
    z = ca.MX.sym("z", count)
    return ca.Function("at_rest", [z], [ca.DM(0, count) @ z])


def affine(seed: int) -> tuple[Array, Array, Any]:
    """A, b, and the problem whose residual is A z - b."""
    rng = np.random.default_rng(seed)
    A, b = rng.standard_normal((40, 12)), rng.standard_normal(40)
    z = ca.MX.sym("z", 12)
    return A, b, function(z, ca.DM(A) @ z - ca.DM(b))


@pytest.mark.parametrize("seed", range(3))
def test_on_an_affine_problem_the_posterior_is_the_dense_gaussian(
    seed: int, unknowns: Unknowns
) -> None:
    A, b, residual = affine(seed)
    problem = Problem(unknowns, residual, unbound(12))
    cov = np.linalg.inv(A.T @ A + np.eye(12))
    belief = posterior(problem, solve(problem, np.ones(12)))
    np.testing.assert_allclose(belief.cov, cov, rtol=0, atol=1e-13)
    np.testing.assert_allclose(belief.mean, cov @ A.T @ b, rtol=0, atol=1e-9)  # IPOPT's tolerance


def test_a_prior_that_is_contradicted_gives_way_and_no_other_does(unknowns: Unknowns) -> None:
    """Data tell two scores, ten below what is expected of both; roots of slopes by hand."""
    z = ca.MX.sym("z", 12)
    problem = Problem(unknowns, function(z, z[:2] + 10.0), unbound(12), DAMPING)
    found = solve(problem, np.zeros(12))
    # Of the second z + 10 + z / (1 + z² / width) = 0, a cubic.
    width = FREEDOM + 1.0
    roots = np.roots([1.0, 10.0, 2.0 * width, 10.0 * width])
    real = roots[np.abs(roots.imag) < 1e-9].real
    np.testing.assert_allclose(found[:2], [-5.0, real[0]], rtol=1e-6)
    assert len(real) == 1 and real[0] < -9.0
    np.testing.assert_allclose(found[2:], 0.0, atol=1e-9)


def test_what_belongs_together_gives_way_together(unknowns: Unknowns) -> None:
    """Of three scores of a group data contradict one: of the others they are believed as much."""
    z = ca.MX.sym("z", 12)
    data = ca.vertcat(z[0] + 10.0, z[1:3] + 1.0, z[3] + 1.0)
    problem = Problem(unknowns, function(z, data), unbound(12), (Contradictable((0, 1, 2)),))
    found = solve(problem, np.zeros(12))
    pull = 1.0 / (1.0 + found[:3] @ found[:3] / (FREEDOM + 3.0))
    np.testing.assert_allclose(found[:4], [*np.array([-10, -1, -1]) / (1.0 + pull), -0.5], 1e-6)
    assert pull < 0.1
    np.testing.assert_allclose(posterior(problem, found).cov[2, 2], 1.0 / (1.0 + pull))


def test_what_is_mounted_at_the_flange_is_in_the_last_link_and_biases_nothing(
    point: Dynamics, motion: Motion, noise: Noise
) -> None:
    """Nobody named it: Gaussian priors had other links bear it and the drive gains pay, by 4 sd."""
    links = point.inertials.copy()
    links[-1] += point.payload
    whole = replace(point, inertials=links, payload=np.zeros(10))
    nobody_said = Unknowns(population(point.arm), (OPTIONAL,) * 6)
    problem = build_problem(nobody_said, compress(whole, motion, noise), whole)
    belief = posterior(problem, solve(problem, np.zeros(len(nobody_said.mean))))
    away = (belief.mean - nobody_said.score(whole, ())) / belief.sd
    gains = [k for k, (name, _) in enumerate(nobody_said.drive, links.size) if name == "gain"]
    masses = range(0, links.size, 10)
    assert len(gains) == 6
    assert np.abs(away[[*gains, *masses]]).max() < norm.isf(0.5 * CHANCE / 12.0)


def test_no_damping_gives_way_upwards(unknowns: Unknowns) -> None:
    """What is expected of structural damping may be missing, and is not exceeded tenfold."""
    z = ca.MX.sym("z", 12)
    problem = Problem(unknowns, function(z, z[:2] - 10.0), unbound(12), DAMPING)
    belief = posterior(problem, solve(problem, np.zeros(12)))
    np.testing.assert_allclose(belief.mean[:2], 5.0, rtol=1e-6)
    np.testing.assert_allclose(belief.sd[:2], np.sqrt(0.5))


def test_no_data_leave_the_prior(unknowns: Unknowns) -> None:
    z = ca.MX.sym("z", 12)
    empty = Problem(unknowns, function(z, ca.DM(0, 12) @ z), unbound(12))
    belief = posterior(empty, solve(empty, np.ones(12)))
    np.testing.assert_allclose(belief.mean, 0.0, atol=1e-9)
    np.testing.assert_allclose(belief.cov, np.eye(12), atol=1e-15)


def test_a_problem_without_a_solution_is_told(unknowns: Unknowns) -> None:
    z = ca.MX.sym("z", 2)
    hopeless = Problem(unknowns, function(z, ca.log(-1.0 - z**2)), unbound(2))
    with pytest.raises(IdentifiabilityError, match="did not converge"):
        solve(hopeless, np.ones(2))


def test_doubt_in_scores_is_the_same_doubt_in_coefficients(
    unknowns: Unknowns, problem: Problem, blocks: list[Compressed], point: Dynamics, truth: Array
) -> None:
    """tr(Rᵀ R cov(w)) over all blocks = tr(Jᵀ J cov(z)), with J the slope of R w."""
    root = np.random.default_rng(8).standard_normal((len(truth),) * 2)
    belief = Gaussian(truth, root @ root.T)
    places = [(block.joint, block.payload) for block in blocks]
    roots = coefficient_roots(unknowns, places, point, belief)
    R = [block.R[:, :-1] for block in blocks]
    each = [np.sum((r @ L) ** 2) for r, L in zip(R, roots, strict=True)]
    whole = np.trace(data_information(problem, truth) @ belief.cov)
    assert sum(each) == pytest.approx(whole, rel=1e-9)
