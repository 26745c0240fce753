"""Healthy streams, benign and adverse, to test a guarantee on false alarms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array


@dataclass(frozen=True)
class Noise:
    """Noise of unit standard deviation before outliers and `scale`."""

    colour: float = 0.0  # of an AR(1)
    student: bool = False  # t with three degrees of freedom
    outliers: float = 0.0  # share of the steps, of six sigma
    scale: float = 1.0  # on the day of the test; 1 on that of the baseline
    skewed: bool = False  # exponential
    restless: float = 0.0  # its sigma is higher by this for 30 steps, lower for the next 30
    swing: float = 0.0  # amplitude of a sine of period 1000 steps with random phase

    def draw(self, rng: np.random.Generator, steps: int, runs: int, scale: float = 1.0) -> Array:
        """A sample, (steps, runs)."""
        lead = 200
        w = self._driving(rng, (steps + lead, runs)) * np.sqrt(1.0 - self.colour**2)
        for t in range(1, len(w) if self.colour else 0):
            w[t] += self.colour * w[t - 1]
        y = w[lead:]
        hit = rng.random(y.shape) < self.outliers
        y = y + 6.0 * hit * rng.choice([-1.0, 1.0], y.shape)
        if self.swing:
            turned = np.arange(steps)[:, None] / 1000.0 + rng.random(runs)
            y = y + self.swing * np.sin(2.0 * np.pi * turned)
        return np.asarray(scale * y)

    def _driving(self, rng: np.random.Generator, size: tuple[int, int]) -> Array:
        """White noise, of unit sd unless `restless`, (steps, runs)."""
        if self.skewed:
            w = rng.exponential(1.0, size) - 1.0
        elif self.student:
            w = rng.standard_t(3, size) / np.sqrt(3.0)
        else:
            w = rng.standard_normal(size)
        more = np.arange(size[0])[:, None] // 30 % 2 == 0
        return np.asarray(w * np.where(more, 1.0 + self.restless, 1.0 - self.restless))


NOISES = {
    "white": Noise(),
    "AR(.9)": Noise(colour=0.9),
    "Student t3": Noise(student=True),
    "2 % outliers of 6 sigma": Noise(outliers=0.02),
    "sigma 20 % wrong": Noise(scale=1.2),
    "all together": Noise(0.9, True, 0.02, 1.2),
    "exponential": Noise(skewed=True),
    "AR(.9), exponential": Noise(colour=0.9, skewed=True),
    "sigma .5 and 1.5 by turns": Noise(restless=0.5),
    "swing of .3 sigma": Noise(swing=0.3),
}
