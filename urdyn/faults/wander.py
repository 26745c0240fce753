"""Wear that wanders: regression on a ramp plus a random walk, by one filter per onset.

    e_t = r h(t - t0) + w u_t + noise,    u_t = u_{t-1} + N(0, q),    u_t0 the level's own doubt

Wear that comes in steps, or is read at unequal times, is a straight line in the long run only; its
past shows how far it strays from one. Given onset and q, a Kalman filter whitens e and h, and the
pace r is a regression on its residuals: S1 = sum nu_h nu / F, S2 = sum nu_h² / F. With q = 0 it is
the plain ramp's. In coloured noise u is what a lasting change leaves in innovations; w is 1 except
after a gap; the transient of the first lags is neglected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from urdyn.types import Array, Mask

STEPS = np.array([0.01, 0.1, 1.0])  # [spread²/step] q, variance of the walk


class Walks(NamedTuple):
    """For every q, onset and stream, (Q, A, n) each."""

    mean: Array  # of u, without a ramp
    shape: Array  # h filtered: u is less by this per unit of r
    var: Array  # of u
    S1: Array
    S2: Array
    misfit: Array  # sum of nu² / F - e², less what the level before the onset explains
    width: Array  # sum of ln F, and of the precision of that level


def set_out(E: Array, precision: Array) -> Array:
    """Walks that begin now, (7, Q, n): u is the level's error, E / precision (n,)."""
    off = E / precision
    one = (off, 0.0, 1.0 / precision, 0.0, 0.0, -E * off, np.log(precision))
    return np.stack([np.broadcast_to(x, (len(STEPS), len(E))) for x in one])


def walked(walks: Array, e: Array, h: Array, w: Array, measured: Mask) -> Array:
    """One step, (7, Q, A, n): to innovations e (n,) a ramp adds r h (A, n), and u adds u w (n,)."""
    x = Walks(*walks)
    var = x.var + STEPS[:, None, None]
    F = np.where(measured, w**2 * var + 1.0, np.inf)
    gain, nu, nu_h = w * var / F, e - w * x.mean, h - w * x.shape
    return np.stack([
        x.mean + gain * nu,
        x.shape + gain * nu_h,
        var - gain * w * var,
        x.S1 + nu_h * nu / F,
        x.S2 + nu_h**2 / F,
        x.misfit + nu**2 / F - e**2,
        x.width + np.log(np.where(measured, F, 1.0)),
    ])  # fmt: skip
