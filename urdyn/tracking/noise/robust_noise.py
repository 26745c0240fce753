"""Robust noise: the larger an outlier, the more noise it is given.

A residual r of sd sigma beyond GATE sigma is given the variance sigma² (r / GATE sigma)⁴: its
influence falls as 1 / r³, so that neither a torn sample moves the belief, nor a new payload before
it is detected.
"""

from __future__ import annotations

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.estimate import Innovation
from urdyn.estimate.innovation import innovation, measured_rows, whitening
from urdyn.types import Array, changed

GATE = 3.0  # [sd]


def with_robust_noise(u: RobotSlice, residual: Array, variance_ratio: Array) -> RobotSlice:
    """The slice with more noise where a joint's current is an outlier.

    Args:
        residual: (J,) [A]; NaN where there is none.
        variance_ratio: expected variance over that of the noise, (J,).
    """
    expected = u.variance * variance_ratio
    wild = residual**2 / (GATE**2 * expected)
    if not np.count_nonzero(wild > 1.0):
        return u
    return changed(u, noise=np.sqrt(u.power + (np.fmax(wild, 1.0) ** 2 - 1.0) * expected))


def without_robust_noise(told: Innovation, added: Array, y: Array) -> Innovation:
    """The innovation without the variance (J,) [A²] that was added for outliers."""
    if not added.any() or not told.measured:
        return told
    rows = measured_rows(y)
    residual, S = told.residual[rows], (told.cov - np.diag(added))[rows][:, rows]
    W, log_det = whitening(S)
    return innovation(y, rows, residual, S, W, log_det)
