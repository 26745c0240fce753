"""What poses cannot determine, and whether a calibration holds beyond them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.identify.kinematics.workspace import Workspace
from urdyn.types import Array

WEAK = 0.3  # share of the prior's standard deviation left by data, from which on it is reported
CLOSE, PARTNERS = 0.5, 3  # correlation worth reporting, and how many to report
BETTER = 0.7  # expected error elsewhere, over the drawing's error here, up to which to trust it
FINE = 1e-6  # [m] errors below any measurement: an arm exactly as drawn, up to rounding
STRANGE = 3.0  # times its error on its own poses, accepted in a held-out region
STILL = np.radians(10.0)  # [rad] travel below which a joint counts as hardly moved


@dataclass(frozen=True)
class Weakness:
    """A coordinate of the geometry that poses leave open, and what it trades off with."""

    name: str
    left: float  # remaining share of the prior's standard deviation [-]
    partners: tuple[tuple[str, float], ...]  # unknowns and correlations, the strongest first


@dataclass(frozen=True)
class Verdict:
    """Whether to trust a calibration elsewhere."""

    trusted: bool
    reasons: tuple[str, ...]  # against it


def rank_of(information: Array, spread: Array) -> int:
    """Number of combinations of unknowns that data determine better than the prior.

    Args:
        information: from data alone, (P, P).
        spread: prior standard deviations, or a reference length and angle, (P,).
    """
    return int((np.linalg.eigvalsh(spread[:, None] * information * spread) > 1.0).sum())


def weaknesses(cov: Array, spread: Array, names: tuple[str, ...]) -> tuple[Weakness, ...]:
    """Coordinates of the geometry on which data say little, the most open first.

    Args:
        cov: of all named unknowns, (P, P); the geometry's come first.
        spread: prior standard deviations of the geometry's.
    """
    sd = np.sqrt(np.diag(cov))
    left = sd[: len(spread)] / spread
    found = []
    for k in np.argsort(-left):
        if left[k] < WEAK:
            break
        correlation = cov[k] / sd[k] / sd
        close = [int(i) for i in np.argsort(-np.abs(correlation)) if i != k][:PARTNERS]
        partners = [(names[i], float(correlation[i])) for i in close if abs(correlation[i]) > CLOSE]
        found.append(Weakness(names[int(k)], float(left[k]), tuple(partners)))
    return tuple(found)


def verdict(
    q: Array, joints: tuple[str, ...], rms: float, drawn: float, held_out: Array, space: Workspace
) -> Verdict:
    """Whether to trust a calibration beyond its own poses.

    Args:
        q: poses from which it was made (N, J) [rad].
        rms: its error there [m].
        drawn: the drawing's error there [m].
        held_out: its error in held-out regions (K,) [m].
        space: errors to expect all over the workspace.
    """
    reasons = []
    elsewhere = float(np.median(space.error))
    enough = BETTER * max(drawn, FINE)
    if elsewhere > enough:
        reasons.append(
            f"elsewhere the tool is expected {1e3 * elsewhere:.2g} mm off, where the drawing is "
            f"{1e3 * drawn:.2g} mm off here"
        )
    worst = float(held_out.max())
    if worst > STRANGE * rms and worst > enough:
        reasons.append(
            f"fitted without one region of the poses it is {1e3 * worst:.2g} mm off there, "
            f"{worst / rms:.1f} times its error at home"
        )
    if not reasons:
        return Verdict(True, ())
    travel = q.max(axis=0) - q.min(axis=0)
    idle = [n for n, way in zip(joints, travel, strict=True) if way < STILL]
    if idle:
        reasons.append(f"hardly moved: {', '.join(idle)}")
    return Verdict(False, tuple(reasons))
