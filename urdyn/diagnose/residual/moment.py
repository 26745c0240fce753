"""A moment of work, half a second, as the information in it: all that slow kinds need.

    A = sum H' R^-1 H        b = sum H' R^-1 r        square = sum r' R^-1 r

Rows are averaged first, to AVERAGED a second: slow signals remain, noise does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.diagnose.residual.rows import COULOMB, HEALTH, STRUCTURAL, Rows, derivatives
from urdyn.model.drive import Drive
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Index

AVERAGED = 50.0  # [Hz] most rows left
ROUGH = 2.5  # [-] times their noise, beyond which neighbours differ by something brief


@dataclass(frozen=True, eq=False)
class Means:
    """Averaged rows of joints that slide on known bristles, relative to an arm with some load."""

    weight: Array  # (M, J) [1/A²]
    residual: Array  # (M, J) [A]
    tool: Array  # (M, J, 10) as in rows
    rigid: Array  # (M, J, c) as in rows
    drive: Array  # (M, 6, J) as in rows
    load: Array  # (M, J) [N·m] rigid-body torque
    more: Array  # (M, J) [A] for a load in addition to the commissioned one
    count: Array  # (J,) values of current
    warm: Array  # (3, J) mean of the rows'


@dataclass(frozen=True, eq=False)
class Pool:
    """The information in some rows about the n states."""

    A: Array  # (n, n)
    b: Array  # (n,)
    square: float  # r' R^-1 r [-]
    warm: Array  # (3, J) mean of the rows'


def averaged(rows: Rows, period: float, noise: Array) -> Means:
    """Rows, averaged, relative to the commissioned arm.

    Args:
        period: [s] between rows.
        noise: sd of white noise as loud as the residual at low frequencies, (J,) [A].
    """
    known = rows.settled & (np.abs(rows.v) > STANDING) & np.isfinite(rows.residual)
    r = np.where(known, rows.residual, 0.0)
    noise = noise * _roughness(rows.residual, noise)
    width = max(1, int(1.0 / (AVERAGED * period) + 0.01))
    at: Index = np.arange(0, len(rows), width)
    weight = known / (noise**2 + rows.doubt**2)
    total = np.add.reduceat(weight, at, axis=0)
    group = np.searchsorted(at, np.arange(len(r)), side="right") - 1
    share = weight / np.where(total > 0.0, total, 1.0)[group]
    load = np.add.reduceat(share * rows.load, at, axis=0)
    return Means(
        weight=total,
        residual=np.add.reduceat(share * r, at, axis=0),
        tool=np.add.reduceat(share[..., None] * rows.tool, at, axis=0),
        rigid=np.add.reduceat(share[..., None] * rows.rigid, at, axis=0),
        drive=np.add.reduceat(share[:, None] * rows.drive, at, axis=0),
        load=load,
        more=np.zeros_like(load),
        count=known.sum(axis=0),
        warm=rows.warm.mean(axis=0),
    )


def _roughness(residual: Array, noise: Array) -> Array:
    """Factor on a moment's noise, (J,): large where neighbours differ by more than noise.

    Slow signals do not. An angle that jumps, and speeds derived from it, call for a current that no
    state of the arm explains.
    """
    apart = np.diff(residual, axis=0)
    known = np.isfinite(apart)
    square = np.where(known, apart, 0.0) ** 2
    ratio = np.sqrt(square.sum(axis=0) / np.maximum(2 * known.sum(axis=0), 1)) / noise
    return np.where(ratio > ROUGH, ratio**2, 1.0)


def laden(means: Means, drive: Drive, m: Array) -> Means:
    """The same relative to an arm that carries m in addition, inertials (10,); exact for any m.

    A piece may reverse a joint's load, and with it the gear's load-dependent friction.
    """
    grip = drive.structural * means.drive[:, COULOMB] * drive.gain / drive.coulomb  # beta s
    through = 1.0 + grip * np.sign(means.load)
    by = drive.gain / through
    tau, likewise = by * (means.tool @ m), by * (means.rigid[..., -10:] @ m)
    load = means.load + tau
    turned = (1.0 + grip * np.sign(load)) / through
    own, held = means.drive.copy(), means.drive[:, STRUCTURAL]
    lost = np.sign(load) * (np.sign(means.load) * held + grip * likewise / drive.gain)
    more = likewise / drive.gain + lost - held
    own[:, STRUCTURAL] = lost
    own[:, HEALTH] -= more
    left = (tau + grip * (np.abs(load) - np.abs(means.load))) / drive.gain
    return replace(
        means,
        residual=means.residual - np.where(means.weight > 0.0, left, 0.0),
        tool=turned[..., None] * means.tool,
        rigid=turned[..., None] * means.rigid,
        drive=own,
        load=load,
        more=means.more + more,
    )


def pooled(means: Means) -> Pool:
    """The information in them."""
    H = derivatives(means.rigid, np.concatenate([means.drive, means.more[:, None]], axis=1))
    root = np.sqrt(means.weight)
    scaled = (root[..., None] * H).reshape(-1, H.shape[2])
    r = (root * means.residual).ravel()
    return Pool(scaled.T @ scaled, scaled.T @ r, float(r @ r), means.warm)
