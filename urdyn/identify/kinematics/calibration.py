"""calibrate(): poses -> the arm's geometry, its uncertainty, and where it holds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_a
from urdyn.identify.kinematics.choose_poses import most_informative
from urdyn.identify.kinematics.doubts import Verdict, Weakness, rank_of, verdict, weaknesses
from urdyn.identify.kinematics.gross import moderate
from urdyn.identify.kinematics.moments import moments
from urdyn.identify.kinematics.placement import Placement, groups
from urdyn.identify.kinematics.richer import WORTH, Choice, choose
from urdyn.identify.kinematics.robust import Found, Sought, begin, flat, solve
from urdyn.identify.kinematics.spread import geometry_spread
from urdyn.identify.kinematics.workspace import SAMPLES, Workspace, expected, roam
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.geometry.drawing import Drawing, drawing_of
from urdyn.model.geometry.transmission import no_effects
from urdyn.progress import Progress, silent
from urdyn.types import Array, Mask

MOST = 20_000  # poses; from a longer log this many are taken, evenly
OWN = 2_000  # poses from a controller's log, which is repetitive
BARE = 30.0  # [nats] loss of likelihood up to which a tool without offset is preferred
FINE = np.array([1e-7, 1e-7])  # [m, rad] smaller residuals are rounding
STRANGER = 0.015  # [m] by which no arm of the right type deviates from its drawing
NEXT = 6  # number of poses proposed
KNOWN = 1e18  # precision of unknowns that are not sought [1/m², 1/rad²]
FRAMES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """The result of calibrating an arm with poses."""

    arm: Arm
    drawing: Drawing
    poses: Poses  # from which it was made, with the convention of their angles resolved
    nominal: Found  # the drawing, with base and tool fitted
    choice: Choice = field(repr=False)
    rank: int  # combinations of unknowns that the poses determine
    space: Workspace  # errors to expect all over the workspace
    verdict: Verdict
    weak: tuple[Weakness, ...]
    proposed: Array  # (NEXT, J) [rad] most informative next poses
    bare: bool  # the tool was assumed to have no offset: the poses are the flange's

    @property
    def found(self) -> Found:
        """Geometry, with the effects that held-out regions prefer."""
        return self.choice.found

    @property
    def geometric(self) -> Found:
        """The best with geometry alone, which other software can use."""
        return self.choice.geometric

    @property
    def sought(self) -> int:
        """Number of unknowns of geometry, base and tool."""
        return len(self.geometric.sought.columns)

    @property
    def sound(self) -> Mask:
        """(N,) poses that are not gross errors."""
        return sound(self.found)

    @property
    def spread(self) -> Array:
        """(P,) prior standard deviations of the geometry's coordinates."""
        return geometry_spread(self.drawing.form)

    @property
    def sd(self) -> Array:
        """(size,) posterior standard deviations of all unknowns."""
        return np.sqrt(np.diag(self.found.posterior.cov))


def calibrate(arm: Arm, poses: Poses, progress: Progress = silent, seed: int = 0) -> Calibration:
    """Calibrate an arm's geometry from static poses, or from the controller's own.

    Robust Bayesian least squares from the drawing, with the spread of real arms as the prior;
    for a tracker's poses, base and tool are unknown and estimated with the rest.

    Args:
        progress: called with what is being done, and the share that is done.
        seed: of all random draws: the same poses give the same calibration.
    """
    rng, poses = np.random.default_rng(seed), usable(arm, poses)
    drawing = drawing_of(arm)
    progress("finding base and tool", 0.0)
    start, poses = begin(drawn(arm, drawing), poses, rng)
    nominal = refitted(start, poses, rng)
    require_this_arm(nominal, arm, poses)
    sought = everything(start, poses)
    progress("fitting the geometry", 0.2)
    geometric = solve(start, poses, sought, rng)
    bare = _bare(geometric, poses, start, rng) if poses.own else None
    choice = choose(bare or geometric, poses, arm, progress)
    geometric = choice.geometric
    progress("judging the workspace", 0.9)
    space = _everywhere(choice.found, arm, poses, rng)
    rank, information = rank_at(geometric, geometric.sought, poses)
    return Calibration(
        arm=arm,
        drawing=drawing,
        poses=poses,
        nominal=nominal,
        choice=choice,
        rank=rank,
        space=space,
        verdict=_verdict(choice, nominal, arm, poses, space),
        weak=_weak(geometric, choice.found, drawing),
        proposed=most_informative(arm, geometric.placement, NEXT, rng, information),
        bare=bare is not None,
    )


def usable(arm: Arm, poses: Poses) -> Poses:
    """The arm's complete poses; of very many, an even selection."""
    given_a(arm, Arm, "arm", "as urdyn.load_arm(name) gives")
    given_a(poses, Poses, "poses", "as urdyn.read_poses(path) gives")
    if poses.q.shape[1] != arm.joints:
        told = f"{arm.name} has {arm.joints}"
        raise InputError(f"the poses are of {poses.q.shape[1]} joints; {told}")
    poses, most = poses.whole(), OWN if poses.own else MOST
    if len(poses) <= most:
        return poses
    rows = np.linspace(0, len(poses) - 1, most).round().astype(np.intp)
    return poses.take(rows)


def everything(start: Placement, poses: Poses, tool: bool = True) -> Sought:
    """Unknowns of geometry, and those of base and tool that the poses can determine."""
    group = groups(start)
    seen = group["tool"] if poses.angles is not None else group["tool"][:3]
    frames = [] if poses.own else [group["base"]]
    frames += [seen] if tool else []
    columns = np.concatenate([group["geometry"], *frames])
    open_ = flat(sum(map(len, frames)))
    spread = np.concatenate([geometry_spread(start.form), open_])
    return Sought(columns, spread, np.zeros(start.size))


def refitted(placement: Placement, poses: Poses, rng: np.random.Generator) -> Found:
    """The same arm with only base and tool fitted to these poses."""
    geometry = len(geometry_spread(placement.form))
    whole = everything(placement, poses)
    columns = whole.columns[geometry:]
    return solve(placement, poses, Sought(columns, flat(len(columns)), whole.expected), rng)


def require_this_arm(nominal: Found, arm: Arm, poses: Poses) -> None:
    """InputError where the poses are so far off the drawing that they are another arm's."""
    off = float(nominal.posterior.noise[0])
    if off > STRANGER:
        raise InputError(
            f"{poses.source.path}: no {arm.name} was there: as drawn it is {1e3 * off:.0f} mm off; "
            "look at --robot, at the order and units of the joints, and at what was measured"
        )


def drawn(arm: Arm, drawing: Drawing) -> Placement:
    """The arm as drawn, with base and tool at the identity."""
    still = np.eye(4)
    return Placement(drawing.form, drawing.form.nominal, no_effects(arm), np.zeros(0), still, still)


def _bare(found: Found, poses: Poses, start: Placement, rng: np.random.Generator) -> Found | None:
    """The fit with the tool at the flange, if that costs less than `BARE`.

    A controller without a configured offset reports the flange's pose. Only then can the last
    link's length and its joint's zero be separated from the tool's pose.
    """
    sought = everything(start, poses, tool=False)
    bare = solve(replace(start, tool=np.eye(4)), poses, sought, rng)
    noise = np.maximum(found.posterior.noise, FINE)
    rows = (found.weight > WORTH) & (bare.weight > WORTH)
    if 2 * rows.sum() < len(rows):
        return None
    chi = [((f.residuals[rows] / np.repeat(noise, 3)) ** 2).sum() for f in (bare, found)]
    off = [
        ((f.placement.deviations / geometry_spread(start.form)) ** 2).sum() for f in (bare, found)
    ]
    return bare if 0.5 * (chi[0] - chi[1] + off[0] - off[1]) < BARE else None


def _everywhere(found: Found, arm: Arm, poses: Poses, rng: np.random.Generator) -> Workspace:
    """Errors to expect at random poses all over the workspace."""
    variance = geometry_spread(found.placement.form) ** 2
    noise = 0.0 if poses.own else float(found.posterior.noise[0])
    everywhere = roam(arm, SAMPLES, rng)
    return expected(found.placement, found.posterior.cov, variance, noise, everywhere)


def _verdict(choice: Choice, nominal: Found, arm: Arm, poses: Poses, space: Workspace) -> Verdict:
    """Whether to trust the chosen model elsewhere."""
    fine = sound(choice.found)
    return verdict(
        poses.q[fine],
        arm.joint_names,
        rms=rms(choice.found, fine),
        drawn=rms(nominal, fine),
        held_out=choice.chosen.rms,
        space=space,
    )


def rank_at(found: Found, sought: Sought, poses: Poses) -> tuple[int, Array]:
    """Rank of the poses' information on what is `sought`, and that information plus the prior's.

    The information is on geometry, base and tool, (P, P); what is not sought counts as known.
    """
    placement, noise = found.placement, found.posterior.noise
    bare = placement.with_effects(no_effects(placement.effects.arm))
    second = moments(bare, poses.q, poses.place, poses.turn, found.weight).H
    data = np.tensordot(noise**-2.0, second, axes=1)
    lengths = np.ones(bare.size)
    lengths[: len(bare.deviations)] = geometry_spread(bare.form)
    columns = sought.columns
    rank = rank_of(data[np.ix_(columns, columns)], lengths[columns])
    known = np.setdiff1d(np.arange(bare.size), columns)
    prior = np.zeros(bare.size)
    prior[columns], prior[known] = sought.spread**-2.0, KNOWN
    data[known], data[:, known] = 0.0, 0.0
    return rank, data + np.diag(prior)


def _weak(geometric: Found, found: Found, drawing: Drawing) -> tuple[Weakness, ...]:
    """Weakly determined coordinates, and what they trade off with."""
    frames = [f"{what}.{axis}" for what in ("base", "tool") for axis in FRAMES]
    names, columns = np.array([*drawing.form.names, *frames]), geometric.sought.columns
    cov = found.posterior.cov[np.ix_(columns, columns)]
    return weaknesses(cov, geometry_spread(drawing.form), tuple(map(str, names[columns])))


def sound(found: Found) -> Mask:
    """(N,) poses that are not gross errors."""
    return moderate(found.residuals, found.posterior.noise)


def rms(found: Found, rows: Mask) -> float:
    """Root mean square of the distance from measured to predicted places [m]."""
    return float(np.sqrt((found.residuals[rows, :3] ** 2).sum(axis=1).mean()))
