"""How steady an arm is from window to window, learnt while it works.

How far windows may be off for reasons of their own is in the rules, for models that fit as badly as
models do. Where this model fits better, a change shows sooner: each block tells how far a joint's
friction is from where the filter expects it, beside how far noise alone would put it. Only steadier
than the rules is ever learnt, so that a fault cannot hide by looking like an unsteady arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.loudness import remembered
from urdyn.types import Array

SHARES = 2.0 ** -np.arange(7.0)  # [-] of the rules' window that are weighed against each other
BELIEVED = 2.0  # [nats] that the rules are worth against each halving
WILD = 3.0  # [sd] that one block counts at most


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Log of the likelihood of each share, (S, J)."""

    told: Array

    @property
    def share(self) -> Array:
        """Of the rules' window, (J,) [-]: root of the mean square."""
        weight = np.exp(self.told - self.told.max(axis=0))
        mean = (weight * SHARES[:, None] ** 2).sum(axis=0) / weight.sum(axis=0)
        return np.asarray(np.sqrt(mean))


def by_the_rules(joints: int) -> Steadiness:
    """Before any block."""
    return Steadiness(np.repeat(BELIEVED * np.log2(SHARES)[:, None], joints, axis=1))


def learnt(steadiness: Steadiness, off: Array, noise: Array, window: Array) -> Steadiness:
    """After a block.

    Args:
        off: how far each joint's friction was from what was expected, (J,) [-]; NaN: not told.
        noise: sd of that in an arm without windows, (J,) [-].
        window: sd of windows by the rules, (J,) [-].
    """
    sd = np.hypot(noise, SHARES[:, None] * window)
    z = np.clip(off / sd[0], -WILD, WILD) * sd[0] / sd
    more = -np.log(sd) - 0.5 * z**2
    told = steadiness.told + np.where(np.isnan(off), 0.0, more - more[0])
    return Steadiness(remembered(told))
