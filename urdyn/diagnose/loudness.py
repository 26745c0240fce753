"""How loud a residual is at low frequencies, learnt while working.

A log's own noise model knows some eighty milliseconds; what friction and structure leave lasts a
second and more, and decides how soon a change can be told from nothing. It is measured where no
change of a joint reaches: in what is left of the means of a block's moments once every direction
that a joint can change in is fitted to them. What lasts for a time tau is louder in the mean of a
block than there, by

    T_block g(T_block / tau) / (T_moment g(T_moment / tau)),    g(x) = 2 (x - 1 + e^-x) / x²
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
    grows: float  # [-] what lasts, over a block beside over a moment

    @property
    def power(self) -> Array:
        """Spectral density at low frequencies over that of white noise, (J,) [-]."""
        measured = self.total / self.freedom
        lasting = np.maximum(measured - 1.0, 0.0)
        return np.asarray(np.maximum(measured, LEAST) + (self.grows / LEFT - 1.0) * lasting)


def growth(lasting: float, moment: float, block: float) -> float:
    """How much louder noise that lasts for a time is over a block than over a moment, all in [s]."""

    def gathered(T: float) -> float:
        x = T / lasting
        return float(T * 2.0 * (x - 1.0 + np.exp(-x)) / x**2)

    return gathered(block) / gathered(moment)


def first(power: Array, grows: float) -> Loudness:
    """What is believed before anything was seen."""
    measured = 1.0 + LEFT / grows * (power - 1.0)
    return Loudness(BELIEVED * measured, np.full(len(power), BELIEVED), grows)


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
    return Loudness(total, freedom, loudness.grows)
