"""What poses cannot tell, and whether a calibration holds beyond where it was made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.identify.kinematics.workspace import Workspace
from urdyn.types import Array

WEAK = 0.3  # share of the prior's standard deviation that data left, from which on we say so
CLOSE, PARTNERS = 0.5, 3  # correlation that is worth a word, and how many words
BETTER = 0.7  # expected error elsewhere, over what the drawing has here, that is worth trusting
FINE = 1e-6  # [m] errors below which nobody measures: of an arm that is as drawn, to rounding
STRANGE = 3.0  # times the error at home that a region held out may have
STILL = np.radians(10.0)  # [rad] travel below which a joint hardly moved


@dataclass(frozen=True)
class Weakness:
    """A coordinate of the geometry that the poses leave open, and what it trades off with."""

    name: str
    left: float  # share of the prior's standard deviation that is left [-]
    partners: tuple[tuple[str, float], ...]  # unknowns and correlation, the closest first


@dataclass(frozen=True)
class Verdict:
    """Should it be trusted elsewhere?"""

    trusted: bool
    reasons: tuple[str, ...]  # against


def rank_of(information: Array, spread: Array) -> int:
    """How many combinations of unknowns the data tell better than the prior does.

    Args:
        information: by data alone, (P, P).
        spread: prior standard deviations, or a length and an angle to measure by, (P,).
    """
    return int((np.linalg.eigvalsh(spread[:, None] * information * spread) > 1.0).sum())


def weaknesses(cov: Array, spread: Array, names: tuple[str, ...]) -> tuple[Weakness, ...]:
    """Coordinates of the geometry that data hardly inform, the most open first.

    Args:
        cov: of all named unknowns, (P, P); the geometry's come first.
        spread: prior standard deviations of these.
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
        q: poses that it was made from (N, J) [rad].
        rms: its error there [m].
        drawn: the drawing's error there [m].
        held_out: its error in regions that were held out (K,) [m].
        space: what is to be expected all over.
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
