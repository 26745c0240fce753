"""How loud a residual is at low frequencies, learnt while working.

A log's own noise model knows some eighty milliseconds; what friction and structure leave lasts a
second and more, and decides how soon a change can be told from nothing. It is measured where no
change of a joint reaches: in what is left of the means of a block's moments once every direction
that a joint can change in is fitted to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.moment import Pool
from urdyn.diagnose.space import Space
from urdyn.types import Array

BELIEVED = 5.0  # moments that the loudness of the first day is worth
DIRECTIONS = ("f", "alpha", "z", "o")
LEFT = 0.4  # [-] of what lasts a second that fitting the directions leaves of it in five
LEAST = 0.5  # [-] of the noise of the first day, squared: no residual is quieter than its sensor


@dataclass(frozen=True, eq=False)
class Loudness:
    """Squared size of what is left, in units of white noise with the residual's variance."""

    total: Array  # (J,) [-]
    freedom: Array  # (J,) moments that this is the sum of

    @property
    def power(self) -> Array:
        """Spectral density at low frequencies over that of white noise, (J,) [-]."""
        measured = self.total / self.freedom
        lasting = np.maximum(measured - 1.0, 0.0)
        return np.asarray(np.maximum(measured, LEAST) + (1.0 / LEFT - 1.0) * lasting)


def first(power: Array) -> Loudness:
    """What is believed before anything was seen."""
    measured = 1.0 + LEFT * (power - 1.0)
    return Loudness(BELIEVED * measured, np.full(len(power), BELIEVED))


def heard(loudness: Loudness, pools: Sequence[Pool], space: Space, noise: Array) -> Loudness:
    """With the moments of a block; `noise` is the residual's sd on the first day, (J,) [A]."""
    total, freedom = loudness.total.copy(), loudness.freedom.copy()
    for j in range(len(noise)):
        columns = [space.places[g].start + j for g in DIRECTIONS]
        scale = np.sqrt([pool.count[j] for pool in pools]) / noise[j]
        told = scale > 0.0
        y = (scale * [pool.residual[j] for pool in pools])[told]
        X = (scale[:, None] * np.array([pool.H[j, columns] for pool in pools]))[told]
        left = len(y) - len(columns)
        if left > 0:
            fitted = X @ np.linalg.lstsq(X, y, rcond=None)[0]
            total[j] += np.sum((y - fitted) ** 2)
            freedom[j] += left
    return Loudness(total, freedom)
