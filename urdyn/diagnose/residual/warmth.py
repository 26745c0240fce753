"""Warm-up, which is no fault: joint temperatures, and the unknowns of their effect.

    lag dL/dt = T - L
    alpha' = alpha exp(-kappa w),    f' = f exp(-kappa_f w),    w = L - T_ref

Joints report their temperature T, their lubricants L do not. The model takes the usual kappa and
lag; a joint's deviations from these, and its lubricant's initial temperature, are states of the
healthy arm in addition to those of `Space`. To first order they change alpha and f by

    d log alpha = -w kappa - kappa_0 (dL/dlog lag) log lag - kappa_0 e^(-t/lag) L_0
    d log f     = -w kappa_f

so that a window's information about the present alpha and f is information about all of these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.diagnose.residual.space import Space
from urdyn.model.population import KAPPA
from urdyn.signal.channels import mean_measured
from urdyn.tracking.belief.model import LAG
from urdyn.tracking.step.warmth import at_least, warmed
from urdyn.types import Array

UNKNOWN = ("kappa", "lag", "start", "coulomb")  # of each joint, after the states of the space


@dataclass(frozen=True, eq=False)
class Warmth:
    """Temperatures of the joints."""

    t: float  # [s]; NaN before the first row
    lubricant: Array  # (J,) [°C]; NaN where no temperature was measured
    slope: Array  # (J,) [K] dL/dlog lag
    left: Array  # (J,) [-] remaining share of the lubricant's unknown initial temperature


def unfelt(joints: int) -> Warmth:
    """Before the first row."""
    nan = np.full(joints, np.nan)
    return Warmth(np.nan, nan, nan, nan)


def felt(warmth: Warmth, t: Array, temperature: Array) -> Warmth:
    """State after some rows without a long gap.

    Args:
        t: (N,) [s].
        temperature: of the joints, (N, J) [°C]; NaN where it is not measured.
    """
    joint = mean_measured(temperature)
    dt = 0.0 if np.isnan(warmth.t) else max(float(t[-1]) - warmth.t, 0.0)
    keep = np.exp(-at_least(warmth.lubricant, joint, dt) / LAG)
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
    """The default temperature coefficient where the fit has none, (J,) [1/K]; else 0."""
    return np.where(space.reference.drive.thermal == 0.0, KAPPA, 0.0)


def unknowns(space: Space, warm: Array) -> Array:
    """D, (n, 4 J): effect of each of UNKNOWN on the states of the space.

    Args:
        warm: w [K], dL/dlog lag [K] and the start's remaining share [-], (3, J); NaN: unmeasured.
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
    """Information about the states of a space, extended to those and the unknowns."""
    return np.block([[A, A @ D], [D.T @ A, D.T @ A @ D]]), np.concatenate([b, D.T @ b])


def narrowed(x: Array, P: Array, D: Array) -> tuple[Array, Array]:
    """Belief about the present states of the space, from that about those and the unknowns."""
    n = len(D)
    cross = P[:n, n:] @ D.T
    now = P[:n, :n] + cross + cross.T + D @ P[n:, n:] @ D.T
    return x[:n] + D @ x[n:], now
