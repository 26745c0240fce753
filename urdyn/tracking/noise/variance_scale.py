"""Scale of the variance that the model states for uncertain motions, estimated from innovations.

When a joint starts, rests or reverses, its friction is uncertain, and under changing acceleration
so is the estimate of that. The slice states a variance u for each, for arms of any kind; here its
factor c on this arm is estimated. With e the innovation, S its variance and r = u / S,

    E e² - (S - c u) = c u,    c = (PRIOR + sum r² (e² - S + c u) / u) / (PRIOR + sum r²)

which weighs every sample by its information. So an arm that starts as its model does is trusted
there as anywhere, and one that sticks is doubted as much as it sticks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.types import Array, changed

PRIOR = 0.1  # [s] of such motion that the stated variance counts as
LEARN = 10.0  # [s] of such motion to average over
CLIP = 3.0  # [sd] beyond which an innovation counts as that large
TOLD = 0.05  # [-] of an innovation's variance: a smaller part tells nothing
LEAST, MOST = 0.01, 4.0  # [-] a tenth of the stated sd; as much as a gear can grip
LITTLE = LEAST * TOLD  # [-] of it: at a smaller scaled part, the stated part is below TOLD


@dataclass(frozen=True, eq=False)
class VarianceScale:
    """Scale of the variances stated for grip and for accelerations, (2, J) each."""

    scale: Array  # [-] c, times the stated variance
    count: Array  # samples behind it, the prior's included


def as_stated(joints: int, period: float) -> VarianceScale:
    """The scale before the first innovation: 1."""
    one = np.ones((2, joints))
    return VarianceScale(one, one * (PRIOR / period))


def updated(
    before: VarianceScale, stated: Array, residual: Array, variance: Array, period: float
) -> VarianceScale:
    """The scale after one more innovation, (J,) [A], NaN where there is none.

    Args:
        stated: variance u, (2, J) [A²].
        variance: of the innovation, S, (J,) [A²]; NaN likewise.
    """
    part = stated / variance
    tells = part > TOLD
    if not np.count_nonzero(tells):
        return before
    part = np.where(tells, part, 0.0)
    missed = np.where(tells, np.minimum(residual**2 / variance, CLIP**2) - 1.0, 0.0)
    weight = np.minimum(part, 1.0)
    count = np.minimum(before.count + weight**2, LEARN / period)
    scale = before.scale + weight / np.maximum(part, 1.0) * missed / count
    return changed(before, scale=np.minimum(np.maximum(scale, LEAST), MOST), count=count)
