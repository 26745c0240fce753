"""Warm-up, which is no fault: how warm joints are, and what nobody knows of what that does.

    lag dL/dt = T - L
    alpha' = alpha exp(-kappa w),    f' = f exp(-kappa_f w),    w = L - T_ref

Joints report their temperature T, their lubricants L do not. The model takes the usual kappa and
lag; how far those of a joint are from that, and how warm its lubricant was at first, are states of
the healthy arm beside those of `Space`. To first order they move alpha and f by

    d log alpha = -w kappa - kappa_0 (dL/dlog lag) log lag - kappa_0 e^(-t/lag) L_0
    d log f     = -w kappa_f

so that a window's information about alpha and f as they are now is information about all of these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.space import Space
from urdyn.signal.channels import mean_measured
from urdyn.tracking.model import KAPPA, LAG
from urdyn.tracking.warmth import warmed
from urdyn.types import Array

UNKNOWN = ("kappa", "lag", "start", "coulomb")  # of each joint, behind the states of the space


@dataclass(frozen=True, eq=False)
class Warmth:
    """How warm the joints are."""

    t: float  # [s]; NaN before the first row
    lubricant: Array  # (J,) [°C]; NaN where nobody measured a temperature
    slope: Array  # (J,) [K] dL/dlog lag
    left: Array  # (J,) [-] how much of the lubricant's unknown start is left


def unfelt(joints: int) -> Warmth:
    """Before the first row."""
    nan = np.full(joints, np.nan)
    return Warmth(np.nan, nan, nan, nan)


def felt(warmth: Warmth, t: Array, temperature: Array) -> Warmth:
    """After some rows of which none is long after the others.

    Args:
        t: (N,) [s].
        temperature: of the joints, (N, J) [°C]; NaN where it is not measured.
    """
    joint = mean_measured(temperature)
    dt = 0.0 if np.isnan(warmth.t) else max(float(t[-1]) - warmth.t, 0.0)
    keep = np.exp(-dt / LAG)
    lubricant = warmed(warmth.lubricant, joint, dt)
    before = np.where(np.isnan(warmth.lubricant), lubricant, warmth.lubricant)
    behind = joint - 0.5 * (lubricant + before)
    slope = keep * np.nan_to_num(warmth.slope) - (1.0 - keep) * np.nan_to_num(behind)
    left = np.where(np.isnan(warmth.left), 1.0, keep * warmth.left)
    missing = np.isnan(lubricant)
    return Warmth(
        float(t[-1]), lubricant, np.where(missing, np.nan, slope), np.where(missing, np.nan, left)
    )


def usual(space: Space) -> Array:
    """The coefficient of warmth that the model takes beside what a log showed, (J,) [1/K]."""
    return np.where(space.reference.drive.thermal == 0.0, KAPPA, 0.0)


def unknowns(space: Space, warm: Array) -> Array:
    """D, (n, 4 J): by how much each of UNKNOWN moves the states of the space.

    Args:
        warm: w [K], dL/dlog lag [K] and what is left of the start [-], (3, J); NaN: not measured.
    """
    J, drive, places = space.joints, space.reference.drive, space.places
    w, slope, left = np.nan_to_num(warm)
    shown = np.where(drive.thermal == 0.0, KAPPA, -drive.thermal / drive.viscous)
    D = np.zeros((space.size, len(UNKNOWN) * J))
    own = np.arange(J)
    for k, moved in enumerate((-w, -shown * slope, -shown * left)):
        D[places["alpha"].start + own, k * J + own] = moved
    D[places["f"].start + own, 3 * J + own] = -w
    return D


def widened(A: Array, b: Array, D: Array) -> tuple[Array, Array]:
    """Information about the states of a space as information about those and the unknown."""
    return np.block([[A, A @ D], [D.T @ A, D.T @ A @ D]]), np.concatenate([b, D.T @ b])


def narrowed(x: Array, P: Array, D: Array) -> tuple[Array, Array]:
    """Belief in the states of the space as they are now, of that in those and the unknown."""
    n = len(D)
    cross = P[:n, n:] @ D.T
    now = P[:n, :n] + cross + cross.T + D @ P[n:, n:] @ D.T
    return x[:n] + D @ x[n:], now
