"""Healthy streams, kind and nasty: what a promise about false alarms is tried on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array


@dataclass(frozen=True)
class Noise:
    """Of unit spread before outliers and `scale`."""

    colour: float = 0.0  # of an AR(1)
    student: bool = False  # t with three degrees of freedom
    outliers: float = 0.0  # share of the steps, of six sigma
    scale: float = 1.0  # on the day of judgement; 1 on that of the baseline

    def draw(self, rng: np.random.Generator, steps: int, runs: int, scale: float = 1.0) -> Array:
        """(steps, runs)."""
        lead = 200
        size = (steps + lead, runs)
        w = rng.standard_t(3, size) / np.sqrt(3.0) if self.student else rng.standard_normal(size)
        w *= np.sqrt(1.0 - self.colour**2)
        for t in range(1, len(w) if self.colour else 0):
            w[t] += self.colour * w[t - 1]
        y = w[lead:]
        hit = rng.random(y.shape) < self.outliers
        return np.asarray(scale * (y + 6.0 * hit * rng.choice([-1.0, 1.0], y.shape)))


NOISES = {
    "white": Noise(),
    "AR(.9)": Noise(colour=0.9),
    "Student t3": Noise(student=True),
    "2 % outliers of 6 sigma": Noise(outliers=0.02),
    "sigma 20 % wrong": Noise(scale=1.2),
    "all together": Noise(0.9, True, 0.02, 1.2),
}
