"""Laws of the log-Cholesky coordinates of a body's inertials."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.errors import ArmError
from urdyn.model.consistency import (
    from_pseudo_inertia,
    inertials,
    is_consistent,
    log_cholesky,
    log_cholesky_jacobian,
    pseudo_inertia,
)
from urdyn.types import Array


def coordinates(*shape: int) -> Array:
    rng = np.random.default_rng(7)
    return rng.normal(scale=0.5, size=(*shape, 10))


def cloud(rng: np.random.Generator) -> tuple[Array, Array]:
    """A body as 50 point masses (50,) [kg] at (50, 3) [m]."""
    return rng.uniform(0.1, 1.0, 50), rng.normal(size=(50, 3))


def inertials_of(mass: Array, r: Array) -> Array:
    """The definition, sum by sum: m, m r, and m (r·r 1 - r rᵀ)."""
    inertia = np.einsum(
        "n,nij->ij", mass, (r * r).sum(1)[:, None, None] * np.eye(3) - r[:, :, None] * r[:, None, :]
    )
    rows, columns = [0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]
    return np.array([mass.sum(), *(mass @ r), *inertia[rows, columns]])


def test_pseudo_inertia_is_the_second_moment_of_homogeneous_points() -> None:
    mass, r = cloud(np.random.default_rng(1))
    points = np.column_stack([r, np.ones(len(r))])
    J = pseudo_inertia(inertials_of(mass, r))
    np.testing.assert_allclose(J, np.einsum("n,ni,nj->ij", mass, points, points), rtol=1e-12)


def test_from_pseudo_inertia_undoes_pseudo_inertia() -> None:
    parameters = np.random.default_rng(2).normal(size=(4, 3, 10))
    np.testing.assert_allclose(
        from_pseudo_inertia(pseudo_inertia(parameters)), parameters, atol=1e-14
    )


def test_every_coordinate_vector_is_a_body_and_every_body_is_one() -> None:
    x = coordinates(5, 6)
    bodies = inertials(x)
    assert bodies.shape == (5, 6, 10)
    assert is_consistent(bodies).all()
    np.testing.assert_allclose(log_cholesky(bodies), x, atol=1e-10)


def test_coordinates_read_as_log_mass_and_centre_of_mass() -> None:
    mass, r = cloud(np.random.default_rng(3))
    x = log_cholesky(inertials_of(mass, r))
    assert np.exp(2 * x[0]) == pytest.approx(mass.sum(), rel=1e-12)
    np.testing.assert_allclose(x[7:], mass @ r / mass.sum(), atol=1e-12)


def test_order_of_the_coordinates_is_that_of_the_paper() -> None:
    alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = x = coordinates()
    U = np.exp(alpha) * np.array(
        [
            [np.exp(d1), s12, s13, t1],
            [0.0, np.exp(d2), s23, t2],
            [0.0, 0.0, np.exp(d3), t3],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    np.testing.assert_allclose(pseudo_inertia(inertials(x)), U @ U.T, rtol=1e-12)


def test_jacobian_equals_finite_differences() -> None:
    x, h = coordinates(3, 2), 1e-6
    # Error of a central difference: h² and rounding / h, both below 1e-8 of the values' size.
    steps = h * np.eye(10)
    differences = (inertials(x[..., None, :] + steps) - inertials(x[..., None, :] - steps)) / 2 / h
    scale = np.abs(inertials(x)).max()
    np.testing.assert_allclose(
        log_cholesky_jacobian(x), np.swapaxes(differences, -1, -2), atol=1e-8 * scale
    )


def test_no_frame_changes_the_verdict() -> None:
    mass, r = cloud(np.random.default_rng(4))
    thin = r * [1.0, 1.0, 1e-3]
    for shift in (0.0, 0.5, 3.0):
        assert is_consistent(inertials_of(mass, thin + shift))
        assert not is_consistent(inertials_of(mass, thin + shift), margin=1e-5)


@pytest.mark.parametrize(
    "impossible",
    [
        [0.0, 0, 0, 0, 1, 0, 1, 0, 0, 1],  # no mass
        [-1.0, 0, 0, 0, 1, 0, 1, 0, 0, 1],  # negative mass
        [1.0, 0, 0, 0, 1, 0, 1, 0, 0, 2.5],  # triangle inequality
        [1.0, 0, 0, 0, 1, 2, 1, 0, 0, 1],  # not positive definite
        [1.0, 2, 0, 0, 1, 0, 1, 0, 0, 1],  # too little inertia for that lever
        [1.0, 0, 0, 0, 0, 0, 0, 0, 0, 0],  # a point
        [np.nan, 0, 0, 0, 1, 0, 1, 0, 0, 1],
        [1.0, 0, 0, 0, np.inf, 0, 1, 0, 0, 1],
    ],
)
def test_what_no_solid_body_has_is_told_from_what_one_has(impossible: list[float]) -> None:
    pair = np.array([impossible, [1.0, 0, 0, 0, 1, 0, 1, 0, 0, 1]])
    assert is_consistent(pair).tolist() == [False, True]


def test_log_cholesky_of_an_impossible_body_names_its_index() -> None:
    pair = np.array([[1.0, 0, 0, 0, 1, 0, 1, 0, 0, 1], [1.0, 0, 0, 0, 1, 0, 1, 0, 0, 2.5]])
    with pytest.raises(ArmError, match=r"\[\[1\]\]"):
        log_cholesky(pair)
