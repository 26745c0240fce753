"""Values that do not fit one another make no value: one line names what, and what it had to be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from urdyn.dbn import MeanReverting, RandomWalk
from urdyn.errors import InputError
from urdyn.estimate import Track
from urdyn.simulate import Payload, Trajectory
from urdyn.types import Gaussian, Log, Motion, Parameters

ONE, TWO, ROWS = np.ones(1), np.ones(2), np.ones((3, 6))
PRIOR = Gaussian(TWO, np.eye(2))


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: Log(ROWS, {}), r"t has the shape \(3, 6\); time is one axis"),
        (lambda: Log(TWO, {"actual_q": ROWS}), r"actual_q has the shape \(3, 6\); t has 2 rows"),
        (lambda: Motion(TWO, *[ROWS] * 6), r"q has the shape \(3, 6\); .* \(2, 6\)"),
        (lambda: Motion(np.arange(3), *[ROWS] * 5, ROWS[:, :5]), r"temperature .* \(3, 6\)"),
        (lambda: Parameters(ONE, ("a", "b"), ("A", "A")), r"values .* \(1,\); .* \(2,\)"),
        (lambda: Parameters(TWO, ("a", "b"), ("A",)), "2 names, 1 units"),
        (lambda: Parameters(TWO, ("a", "a"), ("A", "A")), "two parameters of one name"),
        (lambda: Gaussian(TWO, np.eye(3)), r"cov .* \(3, 3\); .* \(2, 2\)"),
        (lambda: RandomWalk(("a", "b"), PRIOR, ONE), r"diffusion .* \(1,\); .* \(2,\)"),
        (lambda: RandomWalk(("a",), PRIOR, ONE), r"the prior's mean .* \(2,\); .* \(1,\)"),
        (lambda: MeanReverting(("a", "b"), PRIOR, TWO, ONE, TWO), r"time_constant .* \(2,\)"),
        (lambda: Track(("a", "b"), ONE, np.ones((1, 2)), ONE, ()), r"sd .* \(1,\); .* \(1, 2\)"),
        (lambda: Payload(1.0, TWO), r"com .* \(2,\); .* \(3,\)"),
        (lambda: Trajectory(TWO, *[ROWS] * 3), "from time 0"),
        (lambda: Trajectory(np.arange(2), *[ROWS] * 3), r"q .* \(3, 6\); .* \(2, 6\)"),
    ],
)
def test_what_does_not_fit_is_told_by_its_name(asked: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked()
