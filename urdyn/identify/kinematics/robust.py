"""Geometry, base and tool by robust Bayesian least squares, to convergence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.errors import IdentifiabilityError
from urdyn.identify.kinematics.first_guess import guess, tool_of
from urdyn.identify.kinematics.gross import robust_noise, weights
from urdyn.identify.kinematics.moments import Moments, moments
from urdyn.identify.kinematics.placement import BASE, TOOL, Placement, residuals
from urdyn.identify.kinematics.posterior import Posterior, learned, restricted
from urdyn.identify.kinematics.spread import ANYWHERE
from urdyn.io.poses import READINGS, Poses
from urdyn.model.geometry.turns import turn_z
from urdyn.types import Array, Index, freeze

FEW = 1500  # poses for the first steps
STEPS, LAST = 40, 4  # most steps, with few poses and with all
STILL = 0.01  # of a posterior standard deviation: a smaller step ends iteration


@dataclass(frozen=True, eq=False)
class Sought:
    """Which unknowns are sought, and their prior."""

    columns: Index  # of all unknowns of a placement
    spread: Array  # prior standard deviation of each of these
    expected: Array  # (P,) prior mean of all unknowns: zero except where fits begin

    def __post_init__(self) -> None:
        freeze(self, "spread")


@dataclass(frozen=True, eq=False)
class Found:
    """A placement at the posterior's mean."""

    sought: Sought
    placement: Placement
    posterior: Posterior  # with zero mean, about the placement; cov of all unknowns
    weight: Array  # (N,) probability that a pose is not a gross error
    residuals: Array  # (N, 6) [m, rad] in the base's axes


def begin(start: Placement, poses: Poses, rng: np.random.Generator) -> tuple[Placement, Poses]:
    """The placement with base and tool guessed, and the poses with their angles' convention."""
    flanges = start.flanges(poses.q)
    if poses.own:
        return _in_own_base(start, poses), poses
    best: tuple[float, Placement, Poses] | None = None
    for reading in [poses.reading] if poses.reading or poses.angles is None else READINGS:
        read = replace(poses, reading=reading or "rotvec")
        base, tool = guess(flanges, read.place, read.turn, rng)
        placed = replace(start, base=base, tool=tool)
        noise = robust_noise(residuals(placed, read.q, read.place, read.turn))
        if best is None or float(noise[1]) < best[0]:
            best = float(noise[1]), placed, read
    assert best is not None, "at least one way to read angles"
    return best[1], best[2]


def _in_own_base(start: Placement, poses: Poses) -> Placement:
    """The placement in the controller's base, or half a turn from it as in ROS's base_link."""
    placed = []
    for base in (np.eye(4), turn_z(np.pi)):
        flanges = base @ start.flanges(poses.q)
        tool = tool_of(flanges, poses.place, poses.turn)
        placed.append(replace(start, base=base, tool=tool))
    off = [robust_noise(residuals(p, poses.q, poses.place, poses.turn))[0] for p in placed]
    return placed[int(np.argmin(off))]


def solve(start: Placement, poses: Poses, sought: Sought, rng: np.random.Generator) -> Found:
    """The posterior's maximum, starting from `start`."""
    few = poses
    if len(poses) > FEW:
        few = poses.take(np.sort(rng.permutation(len(poses))[:FEW]))
    # Noise that is learnt while residuals are still the drawing's errors takes wrong poses for
    # noise, and these would keep it wide. The median is not moved by them: it comes first.
    placement, noise = _steps(start, few, sought, STEPS, None)
    placement, noise = _steps(placement, few, sought, STEPS, noise)
    if few is not poses:
        placement, noise = _steps(placement, poses, sought, LAST, noise)
    return settled(placement, poses, sought, noise)


def settle(placement: Placement, poses: Poses, sought: Sought, noise: Array) -> Found:
    """A few more steps from a placement close to the maximum."""
    if len(sought.columns):
        placement, noise = _steps(placement, poses, sought, LAST, noise)
    return settled(placement, poses, sought, noise)


def settled(placement: Placement, poses: Poses, sought: Sought, noise: Array) -> Found:
    """The posterior about a placement that is its mean."""
    e = residuals(placement, poses.q, poses.place, poses.turn)
    weight = weights(e, noise)
    near = moments(placement, poses.q, poses.place, poses.turn, weight)
    found = _solved(near, placement, sought, noise)
    return Found(sought, placement, found, weight, e)


def _steps(
    placement: Placement, poses: Poses, sought: Sought, count: int, noise: Array | None
) -> tuple[Placement, Array]:
    """Gauss-Newton steps, and the noise of the last; weights and noise follow the residuals.

    Args:
        noise: to begin with, (2,); None: at every step that of the median alone.
    """
    assert count > 0, "at least one step"
    for _ in range(count):
        e = residuals(placement, poses.q, poses.place, poses.turn)
        # Half of the poses count in any case: a step that overshoots must not reject them all.
        wide = robust_noise(e) if noise is None else np.maximum(noise, robust_noise(e))
        near = moments(placement, poses.q, poses.place, poses.turn, weights(e, wide))
        step = _solved(near, placement, sought, wide)
        placement, noise = placement.moved(step.mean), None if noise is None else step.noise
        if not np.isfinite(step.mean).all():
            raise IdentifiabilityError("the fit diverged; are these joints those of this arm?")
        if (np.abs(step.mean) <= STILL * np.sqrt(np.diag(step.cov))).all():
            break
    return placement, step.noise


def _solved(near: Moments, placement: Placement, sought: Sought, noise: Array) -> Posterior:
    """The posterior of a step from `placement`."""
    offset = sought.expected - where(placement)
    only, precision = near.only(sought.columns), sought.spread**-2.0
    found = learned(only, precision, offset[sought.columns], noise, rounds=3)
    return restricted(found, sought.columns, placement.size)


def where(placement: Placement) -> Array:
    """All unknowns of a placement, with those of base and tool zero: their prior is flat."""
    frames = np.zeros(BASE + TOOL)
    return np.concatenate([placement.deviations, frames, placement.coefficients])


def flat(count: int) -> Array:
    """Prior standard deviations of base or tool."""
    return np.full(count, ANYWHERE)
