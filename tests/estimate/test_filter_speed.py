"""A twin at 500 Hz on one core; run apart, because other work on the machine is measured too."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pytest
from affine_models import Regressors

from urdyn.dbn import AffineObservation, Joined, RandomWalk
from urdyn.estimate import EKF, UKF, Kalman
from urdyn.types import Gaussian

STATES, SENSORS, SLICES = 78, 6, 2000


@pytest.mark.slow
@pytest.mark.parametrize(
    "filter_, limit", [(Kalman(), 1e-4), (EKF(), 1e-4), (UKF(), 4.5e-4), (UKF("simplex"), 4.5e-4)]
)
def test_a_full_model_is_updated_in_time(filter_: Any, limit: float) -> None:
    from threadpoolctl import threadpool_limits

    rng = np.random.default_rng(51)
    prior = Gaussian(np.zeros(STATES), np.eye(STATES))
    model: Joined[Regressors] = Joined(
        RandomWalk(tuple(map(str, range(STATES))), prior, np.full(STATES, 1e-3)),
        AffineObservation(STATES, lambda u: u.Y, 1e-2 * np.eye(SENSORS)),
    )
    state, took = filter_.init(model), []
    with threadpool_limits(1):
        for _ in range(SLICES):
            u = Regressors(rng.standard_normal((SENSORS, STATES)), 0.002)
            y = rng.standard_normal(SENSORS)
            start = perf_counter()
            state, _ = filter_.step(model, state, u, y)
            took.append(perf_counter() - start)
    assert np.median(took[100:]) < limit
    assert np.percentile(took[100:], 99) < 1e-3
