"""The motions available by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.simulate.fourier import fourier
from urdyn.simulate.moves import point_to_point
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.work import Work, pick_and_place, shift

Plan = Callable[[Arm, float, float, np.random.Generator], Trajectory | Work]

MOTIONS: Mapping[str, Plan] = {
    "fourier": fourier,
    "point_to_point": point_to_point,
    "pick_and_place": pick_and_place,
    "shift": shift,
}


def plan(kind: str, arm: Arm, duration: float, rate: float, rng: np.random.Generator) -> Work:
    """A random motion of `duration` [s] at `rate` [Hz]; `arm` includes its payload."""
    if kind not in MOTIONS:
        raise InputError(f"no motion {kind!r}; name one of {', '.join(MOTIONS)}")
    made = MOTIONS[kind](arm, duration, rate, rng)
    return made if isinstance(made, Work) else Work(made)
