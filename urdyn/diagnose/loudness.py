"""How loud a residual is at low frequencies, learnt while working.

A log's own noise model knows some eighty milliseconds; what friction and structure leave lasts a
second and more, and decides how soon a change can be told from nothing. It shows where a block
puts a state of a joint beside where the filter expects it: as far off as that noise is loud. The
level of a current takes it whole, friction, which turns over with every move, only some of it.

A block is heard beside the blocks before it. What is off by as much again and again is no noise,
which has forgotten itself by then: it is a change, that must not hide by looking like noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array

POWERS = 2.0 ** np.arange(0.0, 8.5, 0.5)  # [-] weighed; no residual is quieter than its sensor
DOUBT = 0.9  # sd of the logarithm of what is believed before anything was seen
WILD = 3.0  # [sd] that one block counts at most
TINY = 1e-12  # of a weight: nothing was told
SUREST = 20.0  # [nats] that blocks tell of one power against another, at most
KEPT = 0.5  # [-] of the weight of a block that is left a block on


@dataclass(frozen=True, eq=False)
class Loudness:
    """What blocks have told. The variance of one, if noise is as usual, is v."""

    told: Array  # (S, J) log of the likelihood of each power
    lately: Array  # (J,) where the last ones were: their mean
    weight: Array  # (J,) sum of what each counts for in it: 1 / v, and ever less
    doubt: Array  # (J,) sum of the squares of that, times v: variance of the mean, times weight²

    @property
    def power(self) -> Array:
        """Spectral density at low frequencies over that of white noise, (J,) [-]."""
        weight = np.exp(self.told - self.told.max(axis=0))
        return np.asarray((weight * POWERS[:, None]).sum(axis=0) / weight.sum(axis=0))


def remembered(told: Array) -> Array:
    """Log likelihoods (S, J), of which none is surer than it may be.

    What was so for a whole shift is believed no longer than what was for an hour, once it changes.
    """
    return np.asarray(np.maximum(told - told.max(axis=0), -SUREST))


def first(power: Array) -> Loudness:
    """What is believed before anything was seen."""
    told, nothing = -0.5 * (np.log(POWERS[:, None] / power) / DOUBT) ** 2, np.zeros(len(power))
    return Loudness(told, nothing, nothing, nothing)


def heard(loudness: Loudness, seen: Array, expected: Array, noise: Array, rest: Array) -> Loudness:
    """After a block.

    Args:
        seen: where a state of each joint was, (J,); NaN: not told.
        expected: where it was expected, (J,), by which a first block is judged.
        noise: variance that white noise with the residual's variance would put into that, (J,).
        rest: variance for all other reasons, (J,).
    """
    var, known = POWERS[:, None] * noise + rest, np.isfinite(seen)
    usual = loudness.power * noise + rest
    lasting = loudness.doubt / np.maximum(loudness.weight, TINY) ** 2
    before = np.where(loudness.weight > 0.0, loudness.lately, expected)
    square = (seen - before) ** 2 * usual / (usual + lasting)
    square = np.minimum(square, WILD**2 * usual)
    more = -0.5 * np.log(var) - 0.5 * square / var
    told = remembered(loudness.told + np.where(known, more - more[0], 0.0))
    fresh, kept = np.where(known, 1.0 / usual, 0.0), KEPT * loudness.weight
    weight, doubt = kept + fresh, KEPT**2 * loudness.doubt + fresh
    lately = kept * loudness.lately + fresh * np.where(known, seen, 0.0)
    return Loudness(told, lately / np.maximum(weight, TINY), weight, doubt)
