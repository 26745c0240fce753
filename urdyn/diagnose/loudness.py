"""How loud a residual is at low frequencies, learnt while working.

A log's own noise model knows some eighty milliseconds; what friction and structure leave lasts a
second and more, and decides how soon a change can be told from nothing. It shows where a block
puts a state of a joint beside where the filter expects it: as far off as that noise is loud. The
level of a current takes it whole, friction, which turns over with every move, only some of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array

POWERS = 2.0 ** np.arange(0.0, 8.5, 0.5)  # [-] weighed; no residual is quieter than its sensor
DOUBT = 0.9  # sd of the logarithm of what is believed before anything was seen
WILD = 3.0  # [sd] that one block counts at most


@dataclass(frozen=True, eq=False)
class Loudness:
    """Log of the likelihood of each power, (S, J)."""

    told: Array

    @property
    def power(self) -> Array:
        """Spectral density at low frequencies over that of white noise, (J,) [-]."""
        weight = np.exp(self.told - self.told.max(axis=0))
        return np.asarray((weight * POWERS[:, None]).sum(axis=0) / weight.sum(axis=0))


def first(power: Array) -> Loudness:
    """What is believed before anything was seen."""
    return Loudness(-0.5 * (np.log(POWERS[:, None] / power) / DOUBT) ** 2)


def heard(loudness: Loudness, off: Array, noise: Array, rest: Array) -> Loudness:
    """After a block.

    Args:
        off: how far a state of each joint was from what was expected, (J,); NaN: not told.
        noise: variance that white noise with the residual's variance would put into that, (J,).
        rest: variance for all other reasons, (J,).
    """
    var = POWERS[:, None] * noise + rest
    usual = loudness.power * noise + rest
    square = np.minimum(off**2, WILD**2 * usual)
    more = -0.5 * np.log(var) - 0.5 * square / var
    return Loudness(loudness.told + np.where(np.isnan(off), 0.0, more - more[0]))
