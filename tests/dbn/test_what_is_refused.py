"""What makes no jump and what nothing can be learnt from is refused, with the name of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from urdyn.dbn import (
    AffineObservation,
    Jumps,
    Network,
    Node,
    Smoothed,
    jumps,
    learn_diffusion,
    learn_measurement_noise,
    learn_network,
)
from urdyn.errors import InputError

ONE, TWO = np.ones(1), np.ones(2)
PAIR = Network((Node("a"), Node("b")), ())
HISTORY = Smoothed(np.zeros((4, 2)), np.zeros((4, 2, 2)), np.zeros((3, 2, 2)))


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: jumps(("f", "f.rate"), ["f.rat"], ONE), "no state f.rat; did you mean f.rate"),
        (lambda: jumps(("f",), [], ONE), "one state or more"),
        (lambda: jumps(("f",), ["f"], np.zeros(0)), "one size or more"),
        (lambda: Jumps(np.ones((2, 1)), np.array([0.5, 0.6])), "weights .* together 1"),
        (lambda: Jumps(np.ones((2, 1)), np.array([1.5, -0.5])), "weights .* below 0"),
        (lambda: Jumps(np.ones((2, 1)), ONE), "one row, one weight"),
        (lambda: Jumps(ONE, ONE), "steps"),
        (lambda: Jumps(np.ones((1, 2)), ONE, np.ones(3)), "spread"),
        (lambda: AffineObservation(1, lambda u: np.eye(1), -np.eye(1)), "R .* below 0"),
        (lambda: AffineObservation(1, lambda u: np.eye(1), ONE), r"R .* \(m, m\)"),
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
