"""Laws of every process: two steps are one, Jacobians are derivatives, any observation fits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from urdyn.dbn import (
    AffineObservation,
    Edge,
    Joined,
    Network,
    Node,
    RandomWalk,
    Tick,
    Trend,
    compile_linear,
    jumps,
)
from urdyn.types import Gaussian

PRIOR = Gaussian(np.array([1.0, -2.0, 0.5]), np.diag([1.0, 4.0, 0.25]))
NAMES = ("a", "b", "c")
SOME, RATES, PUSHES = np.array([0, 2]), np.array([0.1, 0.2]), np.array([0.03, 0.05])
DIFFUSION = np.array([0.1, 0.2, 0.3])

PROCESSES = {
    "random walk": RandomWalk(NAMES, PRIOR, DIFFUSION),
    "trend": Trend(NAMES, PRIOR, DIFFUSION, SOME, RATES, PUSHES),
    "fading trend": Trend(NAMES, PRIOR, DIFFUSION, SOME, RATES, PUSHES, time_constant=2.0),
    "network": compile_linear(
        Network(
            (
                Node("a", diffusion=0.2, time_constant=2.0),
                Node("b", diffusion=(0.1, 0.3)),
                Node("c", diffusion=0.3, time_constant=50.0),
            ),
            (Edge("a", "b", 0.7), Edge("b", "c", -0.5), Edge("a", "c", 0.4, shared=True)),
        ),
        {"a": 2, "b": 2, "c": 2},
    ),
}


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES.keys())
@pytest.mark.parametrize("first, second", [(0.3, 1.1), (1e-3, 2e-3), (20.0, 5.0), (1e4, 3.0)])
def test_two_steps_are_one(process: Any, first: float, second: float) -> None:
    x = process.prior.mean + 1.0
    one, two, both = Tick(first), Tick(second), Tick(first + second)
    F = process.transition_jacobian(x, two)
    np.testing.assert_allclose(
        process.transition(process.transition(x, one), two), process.transition(x, both)
    )
    np.testing.assert_allclose(
        F @ process.transition_cov(one) @ F.T + process.transition_cov(two),
        process.transition_cov(both),
        rtol=1e-9,
        atol=1e-15,
    )


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES.keys())
def test_no_time_is_no_change(process: Any) -> None:
    x, still = process.prior.mean + 1.0, Tick(0.0)
    np.testing.assert_allclose(process.transition(x, still), x)
    np.testing.assert_allclose(process.transition_cov(still), 0.0)


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES.keys())
def test_jacobians_are_derivatives_and_all_points_are_one_call(process: Any) -> None:
    """The processes are linear: differences are exact whatever their step."""
    rng, u = np.random.default_rng(0), Tick(0.4)
    n = len(process.names)
    points = rng.standard_normal((2, 5, n))
    moved = process.transition(points, u)
    np.testing.assert_allclose(moved[1, 3], process.transition(points[1, 3], u))
    steps = process.transition(points[0, 0] + np.eye(n), u) - process.transition(points[0, 0], u)
    np.testing.assert_allclose(process.transition_jacobian(points[0, 0], u), steps.T, atol=1e-12)
    assert process.linear.all() and process.prior.mean.shape == (n,)


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES.keys())
def test_any_process_serves_any_observation(process: Any) -> None:
    """What the process adds stands behind the parameters, where no sensor sees it."""
    p, n = 3, len(process.names)
    H = np.arange(6.0).reshape(2, 3)
    model: Joined[Tick] = Joined(process, AffineObservation(p, lambda u: H, np.eye(2), np.ones(2)))
    x = np.random.default_rng(1).standard_normal((4, n))
    np.testing.assert_allclose(model.observe(x, Tick()), x[:, :p] @ H.T + 1.0)
    seen = model.observe_jacobian(x, Tick())
    np.testing.assert_allclose(seen, np.hstack([H, np.zeros((2, n - p))]))
    assert model.linear.all() and model.names == process.names


def test_a_trend_moves_what_drifts_and_nothing_else() -> None:
    trend = PROCESSES["trend"]
    assert trend.names == ("a", "b", "c", "a.rate", "c.rate")
    moved = trend.transition(np.array([1.0, 2.0, 3.0, 10.0, 20.0]), Tick(0.1))
    np.testing.assert_allclose(moved, [2.0, 2.0, 5.0, 10.0, 20.0])


def test_jumps_are_alternatives_of_one_state_each() -> None:
    found = jumps(("a", "b", "c"), ["c", "a"], np.array([1.0, -2.0]))
    np.testing.assert_allclose(found.step, [[0, 0, 1], [0, 0, -2], [1, 0, 0], [-2, 0, 0]])
    np.testing.assert_allclose(found.weight, 0.25)
