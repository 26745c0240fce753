"""Sigma points carry mean and covariance, whatever the rule, with sums of squares only."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest

from urdyn.errors import UrdynError
from urdyn.estimate.sigma_points import Rule, sigma_points

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of what filterpy imports
    from filterpy.kalman import MerweScaledSigmaPoints, unscented_transform

RULES: list[tuple[Rule, float, float, float]] = [
    ("merwe", 1.0, 2.0, 0.0),
    ("merwe", 0.5, 2.0, 1.0),
    ("merwe", 1e-2, 2.0, 0.0),
    ("merwe", 1.0, 0.0, 1.0),
    ("simplex", 1.0, 2.0, 0.0),
]


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("n", [1, 3, 20])
def test_an_affine_function_keeps_its_moments(
    rule: tuple[Rule, float, float, float], n: int
) -> None:
    rng = np.random.default_rng(n)
    A, b = rng.standard_normal((4, n)), rng.standard_normal(4)
    points = sigma_points(n, *rule)
    mean, D = points.moments(points.unit @ A.T + b)
    np.testing.assert_allclose(mean, b, atol=1e-9)
    np.testing.assert_allclose(D.T @ D, A @ A.T, atol=1e-9)


@pytest.mark.parametrize("alpha", [1.0, 0.5, 0.1])
def test_moments_of_a_curved_function_are_filterpys(alpha: float) -> None:
    theirs = MerweScaledSigmaPoints(3, alpha, 2.0, 0.0)
    x = theirs.sigma_points(np.zeros(3), np.eye(3))
    y = np.stack([np.exp(x[:, 0]), x[:, 1] * x[:, 2] + x[:, 0] ** 2], axis=1)
    mean, cov = unscented_transform(y, theirs.Wm, theirs.Wc)
    ours, D = sigma_points(3, "merwe", alpha, 2.0, 0.0).moments(y)
    np.testing.assert_allclose(ours, mean, rtol=1e-9)
    np.testing.assert_allclose(D.T @ D, cov, rtol=1e-9)


def test_points_that_can_give_negative_variances_are_refused() -> None:
    with pytest.raises(UrdynError, match="merwe"):
        sigma_points(5, "merwe", 1.0, 0.0, -2.0)


def test_a_set_that_there_is_not_is_refused() -> None:
    with pytest.raises(UrdynError, match="no sigma points 'foo'; choose one of merwe"):
        sigma_points(5, "foo", 1.0, 2.0, 0.0)  # type: ignore[arg-type]


def test_sigma_points_come_without_the_rest_of_filterpy() -> None:
    code = (
        "import sys; from urdyn.estimate.sigma_points import sigma_points;"
        "sigma_points(3, 'merwe', 1.0, 2.0, 0.0);"
        "print([m for m in sys.modules if m.startswith(('filterpy', 'scipy.stats', 'matplotlib'))])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
