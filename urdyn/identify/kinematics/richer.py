"""Beyond geometry: compliance and joint ripple, where held-out regions prefer them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.identify.kinematics.gross import weights
from urdyn.identify.kinematics.held_out import Model, Trial, best, held_out
from urdyn.identify.kinematics.moments import Moments, moments, total
from urdyn.identify.kinematics.placement import Placement, groups, residuals
from urdyn.identify.kinematics.posterior import restricted
from urdyn.identify.kinematics.regions import regions
from urdyn.identify.kinematics.robust import Found, Sought, settle, where
from urdyn.identify.kinematics.spread import UNEVEN, effects_spread
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.geometry.transmission import Effects, compliance, no_effects, transmission
from urdyn.progress import Progress
from urdyn.types import Array, Index, Mask

GEOMETRY, COMPLIANCE, TRANSMISSION = "geometry", "compliance", "transmission"
WORTH = 0.5  # weight above which a pose counts as sound
CHANGED = 0.02  # change of a weight below which it does not matter


@dataclass(frozen=True, eq=False)
class Choice:
    """The model chosen by held-out regions, and all that were tried."""

    found: Found  # by the chosen model
    geometric: Found  # by geometry alone: its own best, or the chosen model's, as regions prefer it
    stripped: Array  # (K,) its RMS of place by held-out region, base and tool fitted there [m]
    chosen: Trial
    trials: tuple[Trial, ...]  # one per kind of model, simplest first


def choose(found: Found, poses: Poses, arm: Arm, progress: Progress) -> Choice:
    """Try richer models about the geometry `found`."""
    region = regions(poses.q)
    effects = no_effects(arm) if poses.own else transmission(compliance(arm, poses.q))
    rich = found.placement.with_effects(effects)
    parts = _parts(rich, poses, found.weight, region, progress)
    kinds = _models(rich.effects, found.sought, rich.size)
    chosen, trials = _tried(parts, kinds, rich, found, progress)
    richer = _moved(found, rich, chosen, poses)
    changed: Mask = np.abs(richer.weight - found.weight) > CHANGED
    if changed.any() and not poses.own:
        parts = [
            _reweighed(part, rich, poses, (region == k) & changed, found.weight, richer.weight)
            for k, part in zip(np.unique(region), parts, strict=True)
        ]
        kinds = [[trial.model] for trial in trials]
        chosen, trials = _tried(parts, kinds, rich, found, progress)
        richer = _moved(found, rich, chosen, poses)
    alone = min((trials[0], chosen), key=lambda trial: float((trial.stripped**2).sum()))
    geometric = _stripped(found, rich, alone, poses)
    return Choice(richer, geometric, alone.stripped, chosen, trials)


def _stripped(found: Found, rich: Placement, trial: Trial, poses: Poses) -> Found:
    """The geometry of a trial's fit, with base and tool refitted without its effects."""
    moved = _moved(found, rich, trial, poses)
    bare = moved.placement.with_effects(no_effects(rich.effects.arm))
    frames = found.sought.columns[len(bare.deviations) :]
    only = Sought(frames, found.sought.spread[len(bare.deviations) :], np.zeros(bare.size))
    refitted = settle(bare, poses, only, found.posterior.noise)
    return replace(refitted, sought=found.sought)


def _reweighed(
    part: Moments, rich: Placement, poses: Poses, rows: Mask, old: Array, new: Array
) -> Moments:
    """A region's moments with some of its poses' weights changed."""
    if not rows.any():
        return part
    few = poses.take(rows)
    before, after = (
        moments(rich, few.q, few.place, few.turn, weight[rows]) for weight in (old, new)
    )
    return total([part - before, after])


def _parts(
    rich: Placement, poses: Poses, weight: Array, region: Index, progress: Progress
) -> list[Moments]:
    """Moments by region."""
    parts = []
    for k in np.unique(region):
        rows: Mask = region == k
        turn = poses.turn[rows]
        parts.append(moments(rich, poses.q[rows], poses.place[rows], turn, weight[rows]))
        progress("weighing what joints do", (k + 1.0) / (region.max() + 1.0))
    return parts


def _tried(
    parts: Sequence[Moments],
    models: Sequence[Sequence[Model]],
    rich: Placement,
    found: Found,
    progress: Progress,
) -> tuple[Trial, tuple[Trial, ...]]:
    """The best trial, and the best of each kind."""
    offset, noise, group = -where(rich), found.posterior.noise, groups(rich)
    frames = np.concatenate([group["base"], group["tool"]])
    kinds: list[Trial] = []
    for kind in models:
        progress("trying regions that were held out", 0.5)
        of_a_kind = [held_out(parts, model, frames, offset, noise) for model in kind]
        kinds.append(min(of_a_kind, key=lambda trial: float(trial.losses.sum())))
    return best(kinds), tuple(kinds)


def _models(effects: Effects, sought: Sought, size: int) -> list[list[Model]]:
    """Models to try, by kind."""
    first = size - len(effects.owners)
    soft, all_of = len(effects.compliant), len(effects.owners)
    known = sought.spread**-2.0
    kinds = [[Model(GEOMETRY, sought.columns, known, np.zeros(len(known), dtype=np.bool_))]]
    if soft:
        kinds.append([_model(COMPLIANCE, sought, effects, first, soft, UNEVEN[0])])
    if effects.harmonics:
        kinds.append([_model(TRANSMISSION, sought, effects, first, all_of, u) for u in UNEVEN])
    return kinds


def _model(
    name: str, sought: Sought, effects: Effects, first: int, count: int, uneven: float
) -> Model:
    spread = effects_spread(effects.orders[:count], uneven)
    columns = np.concatenate([sought.columns, first + np.arange(count)])
    guessed = np.concatenate([np.zeros(len(sought.columns)), effects.orders[:count]]) > 0.0
    return Model(name, columns, np.concatenate([sought.spread, spread]) ** -2.0, guessed)


def _moved(found: Found, rich: Placement, trial: Trial, poses: Poses) -> Found:
    """The fit by a trial's model, its covariance widened to what held-out regions show."""
    step = restricted(trial.posterior, trial.model.columns, rich.size)
    placement = rich.moved(step.mean)
    if trial.model.name == GEOMETRY:
        step = restricted(trial.posterior, trial.model.columns, found.placement.size)
        placement = found.placement.moved(step.mean)
    e = residuals(placement, poses.q, poses.place, poses.turn)
    return Found(found.sought, placement, step, weights(e, step.noise), e)
