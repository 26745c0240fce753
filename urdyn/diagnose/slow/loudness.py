"""How loud a residual is at low frequencies, learnt while working.

A log's own noise model spans some eighty milliseconds; the residual of friction and structure lasts
a second and more, and decides how soon a change is distinguishable. It shows in the distance of a
block's estimate of a joint's state from the filter's prediction, which scales with that noise. The
level of a current takes all of it; friction, which reverses with every move, only a part.

A block is compared with the blocks before it. A persistent deviation is not noise, which is
uncorrelated between blocks: it is a change, which must not be hidden by being taken for noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array

POWERS = 2.0 ** np.arange(0.0, 8.5, 0.5)  # [-] candidates; no residual is quieter than its sensor
DOUBT = 0.9  # sd of the logarithm in the prior
WILD = 3.0  # [sd] most that one block counts
TINY = 1e-12  # of a weight: no information
SUREST = 20.0  # [nats] most between two powers
KEPT = 0.5  # [-] of a block's weight left one block later


@dataclass(frozen=True, eq=False)
class Loudness:
    """Evidence from blocks. The variance of one, if noise is as usual, is v."""

    told: Array  # (S, J) log of the likelihood of each power
    lately: Array  # (J,) weighted mean of the last ones
    weight: Array  # (J,) sum of their weights in it: 1 / v, decaying
    doubt: Array  # (J,) sum of squared weights times v: variance of the mean, times weight²

    @property
    def power(self) -> Array:
        """Spectral density at low frequencies over that of white noise, (J,) [-]."""
        weight = np.exp(self.told - self.told.max(axis=0))
        return np.asarray((weight * POWERS[:, None]).sum(axis=0) / weight.sum(axis=0))


def remembered(told: Array) -> Array:
    """Log likelihoods (S, J), limited in certainty.

    So what held for a whole shift is abandoned as quickly, once it changes, as what held for an
    hour.
    """
    return np.asarray(np.maximum(told - told.max(axis=0), -SUREST))


def first(power: Array) -> Loudness:
    """The prior."""
    told, nothing = -0.5 * (np.log(POWERS[:, None] / power) / DOUBT) ** 2, np.zeros(len(power))
    return Loudness(told, nothing, nothing, nothing)


def heard(loudness: Loudness, seen: Array, expected: Array, noise: Array, rest: Array) -> Loudness:
    """After a block.

    Args:
        seen: estimate of a state of each joint, (J,); NaN: none.
        expected: its prediction, (J,), with which a first block is compared.
        noise: variance of `seen` from white noise with the residual's variance, (J,).
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
