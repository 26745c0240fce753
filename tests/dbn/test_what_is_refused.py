"""What makes no jump and what nothing can be learnt from is refused, with the name of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from urdyn.dbn import (
    AffineObservation,
    Joined,
    Jumps,
    Network,
    Node,
    RandomWalk,
    Smoothed,
    Tick,
    Trend,
    compile_linear,
    jumps,
    learn_diffusion,
    learn_measurement_noise,
    learn_network,
    observation_residuals,
    process_residuals,
)
from urdyn.errors import InputError
from urdyn.types import Array, Gaussian

ONE, TWO, EYE = np.ones(1), np.ones(2), np.eye(2)
TORN = np.array([[1.0, 2.0], [2.0, 1.0]])
LOPSIDED, HOLED = np.array([[1.0, 0.9], [0.0, 1.0]]), np.array([[1.0, np.nan], [np.nan, 1.0]])
NAMES, PRIOR = ("a", "b"), Gaussian(np.zeros(2), EYE)
PAIR = Network((Node("a"), Node("b")), ())
HISTORY = Smoothed(np.zeros((4, 2)), np.zeros((4, 2, 2)), np.zeros((3, 2, 2)))


def seen(R: Array = EYE, H: Array = EYE, d: Any = 0.0, states: Any = 2) -> AffineObservation[Tick]:
    return AffineObservation(states, lambda u: H, R, d)


def walk(cov: Array = EYE, diffusion: Any = TWO, mean: Any = TWO, **given: Any) -> RandomWalk:
    prior = Gaussian(mean, cov)
    return RandomWalk(**{"names": NAMES, "prior": prior, "diffusion": diffusion, **given})


def ramp(drifting: Any = (0,), tau: float = np.inf, **given: Any) -> Trend:
    one = np.ones(np.size(drifting))
    fields = {"parameters": NAMES, "parameter_prior": PRIOR, "diffusion": TWO, **given}
    return Trend(**fields, drifting=drifting, rate_sd=one, acceleration=one, time_constant=tau)


def looked_at(H: Array) -> Array:
    return seen(H=H).observe(TWO, Tick())


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: jumps(("f", "f.rate"), ["f.rat"], ONE), "no state f.rat; did you mean f.rate"),
        (lambda: jumps(("f",), [], ONE), "one state or more"),
        (lambda: jumps(("f",), ["f"], np.zeros(0)), "one size or more"),
        (lambda: Jumps(np.ones((2, 1)), np.array([0.5, 0.6])), "weights .* together 1"),
        (lambda: Jumps(np.ones((2, 1)), np.array([1.5, -0.5])), "weights .* above 0"),
        (lambda: Jumps(np.ones((2, 1)), np.array([1.0, 0.0])), "weights .* above 0"),
        (lambda: Jumps(np.ones((2, 1)), ONE), "one row, one weight"),
        (lambda: Jumps(ONE, ONE), "steps"),
        (lambda: Jumps(np.ones((1, 2)), ONE, np.ones(3)), "spread"),
        (lambda: AffineObservation(1, lambda u: np.eye(1), -np.eye(1)), "R .* below 0"),
        (lambda: AffineObservation(1, lambda u: np.eye(1), ONE), r"R .* \(m, m\)"),
        (lambda: Jumps(np.array([[np.nan]]), ONE), r"step\[0, 0\] is nan: takes finite"),
        (lambda: Jumps(np.ones((1, 2)), ONE, -TWO), r"spread\[0\] is -1.0: takes .* 0 or more"),
        (lambda: jumps(("f",), ["f"], ONE, np.nan), r"spread\[0, 0\] is nan"),
        (lambda: Jumps(np.ones((2, 1)), np.full(2, 0.5), np.ones((3, 1))), "the 2 steps"),
        (lambda: seen(np.ones((2, 3))), r"R has the shape \(2, 3\); .* covariance, \(m, m\)"),
        (lambda: seen(HOLED), "R holds NaN"),
        (lambda: seen(LOPSIDED), r"R\[0, 1\] is 0.9 and R\[1, 0\] 0; a covariance is symmetric"),
        (lambda: seen(TORN), "R is no covariance: .* eigenvalue -1, .* nearer to 0"),
        (lambda: seen(1.0 - EYE), "R is no covariance"),
        (lambda: seen(d=np.ones(3)), r"d has the shape \(3,\); it has to be \(2,\), or one"),
        (lambda: seen(states=1.5), "states 1.5: takes a whole number"),
        (lambda: looked_at(np.eye(3, 2)), r"H has the shape \(3, 2\); .* it is \(2, 2\)"),
        (lambda: looked_at(np.ones((2, 1))), r"H has the shape \(2, 1\)"),
        (lambda: looked_at(TWO), r"H has the shape \(2,\)"),
        (lambda: walk(names=("b", "b")), "two states of one name: b"),
        (lambda: walk(names=("b", 2)), "a state's name is text, not 2"),
        (lambda: walk(prior=1.0), "the prior 1.0: takes a Gaussian"),
        (lambda: walk(-EYE), "the prior's covariance has the variance -1; .* below 0"),
        (lambda: walk(LOPSIDED), r"the prior's covariance\[0, 1\] is 0.9 and .* symmetric"),
        (lambda: walk(TORN), "the prior's covariance is no covariance"),
        (lambda: walk(HOLED), "the prior's covariance holds NaN"),
        (lambda: walk(mean=np.array([0.0, np.nan])), r"the prior's mean\[1\] is nan"),
        (lambda: walk(diffusion=np.array([0.0, np.nan])), r"diffusion\[1\] is nan"),
        (lambda: walk(diffusion=-TWO), r"diffusion\[0\] is -1.0: takes .* 0 or more"),
        (lambda: walk(diffusion=["x", "y"]), r"diffusion \['x', 'y'\]: takes numbers"),
        (lambda: ramp(tau=-2.0), "time_constant is -2.0: takes a time above 0 s"),
        (lambda: ramp(tau=0.0), "time_constant is 0.0: takes a time above 0 s"),
        (lambda: ramp([5]), r"drifting \[5\]: takes a row of whole numbers from 0 to 1"),
        (lambda: ramp([-1]), r"drifting \[-1\]: takes .* from 0 to 1"),
        (lambda: ramp([True, False]), "drifting .*: takes .* from 0 to 1"),
        (lambda: ramp([0, 0]), "two states of one name: a.rate"),
        (lambda: ramp(parameter_prior=0.0), "the parameters' prior 0.0: takes a Gaussian"),
        (lambda: Joined(walk(), seen(states=3)), "3 states are observed, .* process has 2: a, b"),
        (lambda: Node("a", sd="1"), "a: mean, sd and diffusion have to be finite"),  # type: ignore[arg-type]
        (lambda: compile_linear(PAIR, {"a": 1, "b": 1.5}), "b has no size of 0 or more"),  # type: ignore[dict-item]
        (lambda: Smoothed(np.zeros(3), HISTORY.cov, HISTORY.cross), r"mean has .* \(N \+ 1, n\)"),
        (lambda: Smoothed(HISTORY.mean, HISTORY.cov, HISTORY.cov), r"cross has .* \(3, 2, 2\)"),
        (
            lambda: process_residuals(Joined(walk(), seen()), [Tick()] * 4, HISTORY),
            "there are 4 inputs, and the history has 3 slices",
        ),
        (
            lambda: observation_residuals(
                Joined(walk(), seen()), [Tick()] * 3, np.ones((2, 2)), HISTORY
            ),
            "there are 2 observations, and the history has 3 slices",
        ),
        (lambda: learn_network(PAIR, {"a": 2, "b": 1}, HISTORY, np.ones(3)), "2 states, .* 3"),
        (lambda: learn_network(PAIR, {"a": 1, "b": 1}, HISTORY, TWO), r"dt has the shape \(2,\)"),
        (
            lambda: learn_network(PAIR, {"a": 1, "b": 1}, HISTORY, np.zeros(3)),
            "dt is above 0 in no",
        ),
        (lambda: learn_diffusion(np.ones((2, 1, 1)), np.zeros(2)), "dt is above 0 in no"),
        (lambda: learn_diffusion(np.ones((3, 1, 1)), TWO), "dt has the shape"),
        (lambda: learn_measurement_noise(np.full((3, 2, 2), np.nan)), "sensor 0, 1 never spoke"),
    ],
)
def test_what_makes_no_sense_is_refused(asked: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked()


def test_covariances_that_are_singular_or_short_by_rounding_are_taken() -> None:
    together, none = np.ones((2, 2)), np.zeros((2, 2))
    rounded = EYE + np.array([[0.0, 1e-9], [0.0, 0.0]])
    for cov in (together, none, rounded, np.diag([1.0, -1e-16]), np.diag([1e-30, 1e12])):
        assert (cov == seen(cov).R).all()
        assert (walk(cov, np.zeros(2)).prior.cov == cov).all()


def test_what_is_one_for_all_and_what_is_listed_is_taken() -> None:
    np.testing.assert_array_equal(seen(d=ONE).observe(TWO, Tick()), [2.0, 2.0])
    assert ramp([1]).names == ("a", "b", "b.rate")
    assert ramp([]).names == NAMES
    learnt = learn_network(PAIR, {"a": 1, "b": 1}, HISTORY, [1.0, 0.0, 1.0])  # type: ignore[arg-type]
    assert learnt == learn_network(PAIR, {"a": 1, "b": 1}, HISTORY, np.array([1.0, 0.0, 1.0]))
    assert learn_diffusion(np.ones((2, 1, 1)), [4.0, 4.0]) == 0.5  # type: ignore[arg-type]
