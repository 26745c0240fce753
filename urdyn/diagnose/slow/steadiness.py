"""How steady an arm is from window to window, learnt while it works.

The rules give how far windows may be off by themselves, for a typical model. Where this model fits
better, a change shows sooner: each block shows how far a joint's friction is from the filter's
prediction, compared with noise alone. The arm is only ever learnt to be steadier than the rules, so
that a fault cannot pass for an unsteady arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.slow.loudness import remembered
from urdyn.types import Array

SHARES = 2.0 ** -np.arange(7.0)  # [-] candidate shares of the rules' window
BELIEVED = 2.0  # [nats] prior of the rules against each halving
WILD = 3.0  # [sd] most that one block counts


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Log of the likelihood of each share, (S, J)."""

    told: Array

    @property
    def share(self) -> Array:
        """Share of the rules' window, (J,) [-]: root of the mean square."""
        weight = np.exp(self.told - self.told.max(axis=0))
        mean = (weight * SHARES[:, None] ** 2).sum(axis=0) / weight.sum(axis=0)
        return np.asarray(np.sqrt(mean))


def by_the_rules(joints: int) -> Steadiness:
    """Before any block."""
    return Steadiness(np.repeat(BELIEVED * np.log2(SHARES)[:, None], joints, axis=1))


def learnt(steadiness: Steadiness, off: Array, noise: Array, window: Array) -> Steadiness:
    """After a block.

    Args:
        off: how far each joint's friction was from its prediction, (J,) [-]; NaN: unknown.
        noise: sd of that for an arm without such windows, (J,) [-].
        window: sd of windows by the rules, (J,) [-].
    """
    sd = np.hypot(noise, SHARES[:, None] * window)
    z = np.clip(off / sd[0], -WILD, WILD) * sd[0] / sd
    more = -np.log(sd) - 0.5 * z**2
    told = steadiness.told + np.where(np.isnan(off), 0.0, more - more[0])
    return Steadiness(remembered(told))
