"""Motions to and fro, as a weld's weave: the lines that they make in a joint's current.

What such a motion does, where it turns above all, it does in every period, and makes lines at its
multiples of any size. Friction of a joint that turns over changes by twice its size at once each
time, which makes 4 f / (pi k) of all of them at the k-th multiple, at most.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

LASTS = 4.0  # [s] in which it is seen whether a joint goes so
SLOW = 0.01  # [rad/s] slower than this beside the mean, a joint has no way that it goes
LEFT = 0.1  # [-] of a quick swing, what a taper leaves of it and more
EVEN = 3, 0.03  # periods of a motion to and fro, at least, and [-] sd by which they may differ
IN_STEP = 0.1, 3e-3  # bins of a window, and [-] of a frequency, that a line may be off a multiple
ANSWERED = 2.0  # [-] times its friction, what a joint may make of it: a controller answers


def periods(t: Array, v: Array, quick: int) -> Array:
    """Of each joint that goes to and fro at this speed, (n, J), in whatever way [s]; inf: none.

    Args:
        quick: rows in which something swings once that is no motion.
    """
    return np.array([period(turns(t, each, quick)) for each in v.T])


def in_step(frequency: float, periods: Array, window: float) -> bool:
    """Whether a line that was heard for `window` [s] may be a multiple of such a motion."""
    rates = 1.0 / periods[np.isfinite(periods)]
    off = np.abs(frequency - rates * np.rint(frequency / rates))
    return bool((off < IN_STEP[0] / window + IN_STEP[1] * frequency).any())


def by_friction(multiple: float, coulomb: float) -> float:
    """The most that a joint's friction [N·m] makes of such a motion at a multiple of it [N·m]."""
    return ANSWERED * 4.0 * coulomb / (np.pi * multiple)


def turns(t: Array, v: Array, quick: int) -> Array:
    """When a joint of this speed, (n,), turned over beside its mean motion, (k,) [s].

    Args:
        quick: rows in which something swings once that is no motion; half a window of these at
            both ends tells nothing.
    """
    taper = np.hanning(2 * quick + 1)
    if not np.isfinite(v).all() or len(v) < 2 * len(taper):
        return np.zeros(0)
    inner = slice(quick, len(t) - quick)
    slow, t = np.convolve(v, taper / taper.sum(), "valid"), t[inner]
    left = LEFT * float(np.std(v[inner] - slow))  # of what is quick
    slow -= np.polynomial.Polynomial.fit(t, slow, 2)(t)
    told = np.flatnonzero(np.abs(slow) > max(SLOW, left))
    k = np.flatnonzero(np.diff(np.sign(slow[told])))
    before, after = told[k], told[k + 1]
    share = slow[before] / (slow[before] - slow[after])
    return np.asarray(t[before] + share * (t[after] - t[before]))


def period(turned: Array) -> float:
    """Of a motion to and fro that turned over at these times [s]; inf: it is none, or not yet."""
    each = turned[2:] - turned[:-2]  # ways there are as long as one another, and ways back are
    even = len(each) >= EVEN[0] and np.std(each) < EVEN[1] * each.mean()
    return float(each.mean()) if even else np.inf
