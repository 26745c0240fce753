"""Motions to and fro, such as a weld's weave, and the lines that they make in a joint's current.

The effects of such a motion, above all at its turns, repeat in every period and make lines of any
size at its multiples. Friction of a reversing joint jumps by twice its size each time, which makes
a k-th multiple of at most 4 f / (pi k).
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

LASTS = 4.0  # [s] over which such a motion is detected
SLOW = 0.01  # [rad/s] below this, relative to the mean, a joint has no direction
LEFT = 0.1  # [-] of a quick swing: more than a taper leaves of it
EVEN = 3, 0.03  # least periods of a motion to and fro, and [-] most sd between them
IN_STEP = 0.1, 3e-3  # bins of a window, and [-] of a frequency, by which a line may miss a multiple
ANSWERED = 2.0  # [-] times its friction that a joint may show: a controller responds


def periods(t: Array, v: Array, quick: int) -> Array:
    """Period [s] of each joint that moves to and fro at this speed, (n, J); inf: none.

    Args:
        quick: rows of one swing that is no motion.
    """
    return np.array([period(turns(t, each, quick)) for each in v.T])


def in_step(frequency: float, periods: Array, window: float) -> bool:
    """Whether a line seen over `window` [s] may be a multiple of such a motion."""
    rates = 1.0 / periods[np.isfinite(periods)]
    off = np.abs(frequency - rates * np.rint(frequency / rates))
    return bool((off < IN_STEP[0] / window + IN_STEP[1] * frequency).any())


def by_friction(multiple: float, coulomb: float) -> float:
    """Largest line [N·m] that a joint's friction [N·m] makes at a multiple of such a motion."""
    return ANSWERED * 4.0 * coulomb / (np.pi * multiple)


def turns(t: Array, v: Array, quick: int) -> Array:
    """When a joint of this speed, (n,), reversed relative to its mean motion, (k,) [s].

    Args:
        quick: rows of one swing that is no motion; this many at both ends are lost.
    """
    taper = np.hanning(2 * quick + 1)
    if not np.isfinite(v).all() or len(v) < 2 * len(taper):
        return np.zeros(0)
    inner = slice(quick, len(t) - quick)
    slow, t = np.convolve(v, taper / taper.sum(), "valid"), t[inner]
    left = LEFT * float(np.std(v[inner] - slow))  # of quick swings
    slow -= np.polynomial.Polynomial.fit(t, slow, 2)(t)
    told = np.flatnonzero(np.abs(slow) > max(SLOW, left))
    k = np.flatnonzero(np.diff(np.sign(slow[told])))
    before, after = told[k], told[k + 1]
    share = slow[before] / (slow[before] - slow[after])
    return np.asarray(t[before] + share * (t[after] - t[before]))


def period(turned: Array) -> float:
    """Period of a motion to and fro that reversed at these times [s]; inf: none, or not yet."""
    each = turned[2:] - turned[:-2]  # forward ways are equally long, and so are ways back
    even = len(each) >= EVEN[0] and np.std(each) < EVEN[1] * each.mean()
    return float(each.mean()) if even else np.inf
