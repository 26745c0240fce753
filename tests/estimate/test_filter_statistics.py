"""Statistics: what a filter says of its own errors is true. Bounds are chi-square quantiles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from affine_models import random_model, simulate, ticks
from bent_models import Product
from scipy.stats import chi2

from urdyn.estimate import (
    EKF,
    UKF,
    Consider,
    InformationFilter,
    Kalman,
    ParticleFilter,
    Variational,
    track,
)

RARE = 1e-4  # of either tail: how often a correct filter fails a test here

AFFINE = [Kalman(), UKF(), InformationFilter(), Variational(), ParticleFilter(count=5)]
BENT = [EKF(iterations=3), UKF(), Variational()]
PARTICLES, LIVES, FEW = ParticleFilter(300, marginalise=True), 250, 80


def within_chi_square(total: float, freedom: int) -> bool:
    low, high = chi2.ppf([RARE, 1.0 - RARE], freedom)
    return bool(low < total < high)


@pytest.mark.parametrize("filter_", AFFINE, ids=lambda f: type(f).__name__)
def test_surprise_is_as_large_as_foretold(filter_: Any) -> None:
    rng = np.random.default_rng(11)
    model = random_model(rng, 4, 2)
    observations = simulate(model, ticks(400), rng)[1]
    observations[rng.random(observations.shape) < 0.2] = np.nan
    found = track(filter_, model, ticks(400), observations)
    measured = sum(i.measured for i in found.innovations)
    assert measured == np.isfinite(observations).sum()
    assert within_chi_square(sum(i.nis for i in found.innovations), measured)


@pytest.mark.parametrize(
    ("filter_", "lives"),
    [
        *((filter_, LIVES) for filter_ in BENT),
        (PARTICLES, FEW),
        pytest.param(PARTICLES, LIVES, marks=pytest.mark.slow),
    ],
    ids=lambda f: str(f) if isinstance(f, int) else type(f).__name__,
)
def test_error_is_as_large_as_foretold_where_the_model_bends(filter_: Any, lives: int) -> None:
    rng = np.random.default_rng(12)
    model, total = Product(), 0.0
    for _ in range(lives):
        states, observations = simulate(model, ticks(8), rng)
        state = filter_.init(model)
        for u, y in zip(ticks(8), observations, strict=True):
            state, _ = filter_.step(model, state, u, y)
        belief = filter_.belief(state)
        error = belief.mean - states[-1]
        total += float(error @ np.linalg.solve(belief.cov, error))
    assert within_chi_square(total, 2 * lives)


def test_a_filter_that_holds_its_mean_is_still_surprised_as_foretold() -> None:
    """The first innovation of many lives: later ones share the error that is held."""
    rng = np.random.default_rng(13)
    model = random_model(rng, 4, 2)
    total = 0.0
    for _ in range(400):
        observations = simulate(model, ticks(3), rng)[1]
        total += track(Consider(), model, ticks(3), observations).innovations[-1].nis
    assert within_chi_square(total, 800)
