"""How a healthy stream may change: Markov chains of cells that a mixture sums over.

A healthy stream's innovations are standard normal or narrower. Under an alternative their mean is
that of the chain's present cell: a step has one cell; a ramp has a row of cells of rising mean,
which it passes, on average, at its rate. So all onsets are summed without being stored, and between
two rates of the grid the data choose the pace.
A cell's likelihood ratio is the exponential tilt of a clipped innovation,

    L = exp(lambda g - psi),   psi = ln E exp(lambda g),

with g the innovation clipped (a mean) or its square (a variance), and the expectation over healthy
noise: E L <= 1, whatever the tails do beyond the clip. Here psi is a normal's; a `Mixture` given
skewed noise raises it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.special import ndtr

from urdyn.errors import InputError
from urdyn.given import given, positive
from urdyn.types import Array, freeze

CLIP = 2.5  # [sd] at which innovations are clipped
PHASES = 8  # cells that a ramp passes
REACH = 2.2  # mean of a ramp's last cell over the mean at which such a ramp is usually found
PATIENCE = 10.0  # nats of evidence at which a ramp is found
CHANGING = 0.05  # prior weight of the variances, against ramps and steps
JUMP = 0.25  # prior weight of a step relative to a ramp of 1 sd/step: wear is gradual
HURRY = 1.0 / 3.0  # power of the rate in a ramp's prior weight: a steep one leaves little time
LOOSE = 1.25  # [-] factor by which healthy spread may exceed its bound before it is a fault


@dataclass(frozen=True, eq=False)
class Cells:
    """H cells of all alternatives, of one stream."""

    kinds: tuple[str, ...]  # of the alternatives
    kind: Array  # (H,) alternative of each cell
    side: Array  # (H,) +1 the mean rises, -1 it falls, 0 the variance grows
    tilt: Array  # (H,) lambda [1/sd], [1/sd²] for a variance
    psi: Array  # (H,)
    stay: Array  # (H,) probability of staying in the cell
    move: Array  # (H,) probability of moving here from the previous cell
    entry: Array  # (H,) relative prior weight of a change beginning here
    age: Array  # (H,) [steps] mean age of the change while in the cell

    def __post_init__(self) -> None:
        freeze(self, *(f.name for f in fields(self) if f.name != "kinds"))

    def __len__(self) -> int:
        return len(self.tilt)


def cells(
    rates: Sequence[float] = (0.004, 0.015, 0.05, 0.2, 0.8),
    steps: Sequence[float] = (0.6, 1.8),
    variances: Sequence[float] = (2.0, 4.0),
) -> Cells:
    """Alternatives on a grid.

    Args:
        rates: of ramps [sd/step].
        steps: sizes of steps [sd].
        variances: ratios of the variance to the healthy one.

    Raises:
        InputError: there is no alternative, or one is no change.
    """
    rates = given(rates, "rates", "positive numbers", positive).tolist()
    steps = given(steps, "steps", "positive numbers", positive).tolist()
    variances = given(variances, "variances", "numbers above 1", lambda x: x > 1.0).tolist()
    if not (rates or steps or variances):
        raise InputError("no rates, steps or variances: there is nothing to look for")
    rows: list[Array] = []
    kinds: list[str] = []
    grows = np.array([*(rate**HURRY for rate in rates), *(JUMP for _ in steps)])
    grows *= 0.5 * (1.0 - CHANGING * bool(variances)) / max(grows.sum(), JUMP)
    for side, way in ((1.0, "up"), (-1.0, "down")):
        for rate, share in zip(rates, grows, strict=False):
            rows.append(_ramp(len(kinds), side, rate, share))
            kinds.append(f"ramp {way}")
        for size, share in zip(steps, grows[len(rates) :], strict=True):
            rows.append(_lasting(len(kinds), side, size, float(mean_psi(size)), share))
            kinds.append(f"step {way}")
    for ratio in variances:
        tilt = 0.5 * (1.0 - 1.0 / ratio) / LOOSE**2
        share = CHANGING / len(variances)
        rows.append(_lasting(len(kinds), 0.0, tilt, square_psi(tilt), share))
        kinds.append("variance")
    return Cells(tuple(kinds), *np.vstack(rows).T)


def _ramp(kind: int, side: float, rate: float, weight: float) -> Array:
    """Cells of a ramp, (phases, 8)."""
    top = min(REACH * (6.0 * PATIENCE * rate) ** (1.0 / 3.0), CLIP)
    width = max(top / PHASES, rate)
    mean = np.minimum((np.arange(np.ceil(top / width)) + 0.5) * width, CLIP)
    leave = rate / width
    last, first = np.arange(len(mean)) == len(mean) - 1, np.arange(len(mean)) == 0
    one = np.ones(len(mean))
    return np.column_stack(
        [
            kind * one,
            side * one,
            mean,
            mean_psi(mean),
            np.where(last, 1.0, 1.0 - leave),
            np.where(first, 0.0, leave),
            np.where(first, weight, 0.0),
            mean / rate,
        ]
    )


def _lasting(kind: int, side: float, tilt: float, psi: float, weight: float) -> Array:
    """The one cell of a constant change, (1, 8)."""
    return np.array([[kind, side, tilt, psi, 1.0, 0.0, weight, np.nan]])


def mean_psi(tilt: Array | float) -> Array:
    """ln E exp(tilt c) of c, a clipped standard normal."""
    tilt = np.asarray(tilt)
    inside = np.exp(0.5 * tilt**2) * (ndtr(CLIP - tilt) - ndtr(-CLIP - tilt))
    return np.asarray(np.log(inside + 2.0 * np.cosh(CLIP * tilt) * ndtr(-CLIP)))


def square_psi(tilt: float) -> float:
    """ln E exp(tilt c²) of c, a clipped normal of sd LOOSE; 2 tilt LOOSE² < 1."""
    narrow = np.sqrt(1.0 - 2.0 * tilt * LOOSE**2)
    inside = (2.0 * ndtr(CLIP / LOOSE * narrow) - 1.0) / narrow
    return float(np.log(inside + 2.0 * np.exp(tilt * CLIP**2) * ndtr(-CLIP / LOOSE)))
