"""How much more friction a joint has: the torque of all its terms, not one.

A fault's addition is measured where the arm moved; which term it is in, f, alpha or beta, is known
far less well, and for a term that fades with speed not at all. So a change is read as

    size = F / F_before - 1,    F = mean of (f + g exp(-|v|/v_s) + beta |tau_load| + alpha |v|)

over the samples that slide, each weighted by its information.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from urdyn.diagnose.residual.moment import Means
from urdyn.diagnose.residual.rows import OWN
from urdyn.model.drive import Drive
from urdyn.model.friction import fading
from urdyn.types import Array

TERMS = ("f", "alpha", "beta")  # states of a joint that are friction
NAMES = ("coulomb", "viscous")  # of those that friction faults change
LEAST = 0.1  # [-] least friction that a joint had before it got worse, of the commissioned one

Belief = tuple[Array, Array]  # mean (3,) and covariance (3, 3) of TERMS of a joint


def lost(means: Means, drive: Drive) -> Array:
    """Commissioned friction along the motion, by TERMS and in total, (4, J) [1/A].

    Weighted sums over rows.
    """
    own = means.drive[:, [OWN.index(name) for name in TERMS]]
    along = np.sign(own[:, :1]) * own
    speed = along[:, 1] * drive.gain / drive.viscous
    fades = drive.stribeck / drive.gain * fading(speed, drive)
    every = np.concatenate([along, (along.sum(axis=1) + fades)[:, None]], axis=1)
    return np.asarray(np.einsum("mj,mkj->kj", means.weight, every))


def share(blocks: Iterable[Array | float], joint: int) -> Array | None:
    """Share of each of TERMS in all friction of a joint, (3,) [-]; None where nothing slid.

    Args:
        blocks: `lost` in each of them.
    """
    seen = [np.asarray(of)[:, joint] for of in blocks if np.ndim(of)]
    total = np.sum(seen, axis=0) if seen else np.zeros(len(TERMS) + 1)
    return np.asarray(total[:-1] / total[-1]) if total[-1] > 0.0 else None


def rise(of: Array, now: Belief, before: Belief, first: Array, day: float) -> tuple[float, float]:
    """How much more friction there is than before, and its sd [-].

    Each term is less certain than their sum, as f and alpha trade off: on the first day the sum is
    known to `day`, or to as much as it was seen to be off.

    Args:
        of: share of each of TERMS in all friction, (3,) [-].
        first: covariance of TERMS on the first day, (3, 3).
        day: sd of all friction from day to day [-].
    """
    off, var, usual = float(of @ before[0]), float(of @ before[1] @ of), float(of @ first @ of)
    seen = max(1.0 / var - 1.0 / usual, 0.0)  # by what this run had shown by then
    known = 1.0 / (seen + max(day, abs(off)) ** -2.0)
    was = max(1.0 + off * known / var, LEAST)
    times = (1.0 + float(of @ now[0])) / was
    return times - 1.0, float(np.sqrt(of @ now[1] @ of + times**2 * known)) / was


def apart(now: Belief, before: Belief, first: Array) -> dict[str, dict[str, float]]:
    """How much more there is of each of NAMES, likewise; less certain than for all friction."""
    day = np.sqrt(np.diag(first))
    told = (rise(of, now, before, first, sd) for of, sd in zip(np.eye(len(day)), day, strict=True))
    return {name: {"size": size, "sd": sd} for name, (size, sd) in zip(NAMES, told, strict=False)}
