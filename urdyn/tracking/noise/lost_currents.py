"""Whitening across lost currents: what is expected in their place, and how uncertain that is.

As in `urdyn.faults.gaps`, a Kalman filter over the last p rows x of an autoregression a, exact
where nothing is missing [Jones1980]_:

    f = a'x,    v = 1 + a'P a,    x += P a / v (y - f)

A lost row is f, with variance v, until later ones correct it. All of it is linear: inputs and
currents alike pass through it, so that y - f is that of the noise, whatever the parameters are.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Mask


def bridged(
    past: Array, doubt: Array, ar: Array, now: Array, foreseen: Array, lost: Mask
) -> tuple[Array, Array, Array]:
    """The past and its doubt with one more row, and the variance of y - f in that row, (J,) [-].

    Args:
        past: inputs and current, newest first, (p, J, w + 1); NaN where not compared.
        doubt: P, covariance of its noise over that of the innovations, (J, p, p).
        ar: a, (J, p).
        now: the row, (J, w + 1); NaN where there is no current.
        foreseen: f, (J, w + 1).
        lost: whether it is without a current for a loss only, (J,).
    """
    missed = now - foreseen
    seen = np.isfinite(missed[:, -1:])
    cross = (doubt @ ar[..., None])[..., 0]
    v = 1.0 + np.vecdot(ar, cross)
    gain = np.where(seen, cross / v[:, None], 0.0)
    # Where all rows of the past were lost nothing is expected: noise begins anew, as after a gap.
    lost = lost & ~doubt.diagonal(axis1=1, axis2=2).all(axis=1)
    newest = np.where(lost[:, None], foreseen, now)
    older = past + gain.T[..., None] * np.where(seen, missed, 0.0)
    left = doubt - v[:, None, None] * gain[:, :, None] * gain[:, None, :]
    after = np.zeros_like(doubt)
    after[:, 1:, 1:] = left[:, :-1, :-1]
    after[:, 0, 1:] = after[:, 1:, 0] = np.where(lost[:, None], cross, 0.0)[:, :-1]
    after[:, 0, 0] = np.where(lost, v, 0.0)
    return np.concatenate([newest[None], older[:-1]]), after, v
