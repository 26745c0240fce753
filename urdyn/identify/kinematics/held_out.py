"""Which model holds in regions that it has not seen: geometry alone, or with what joints do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.identify.kinematics.moments import Moments, total
from urdyn.identify.kinematics.posterior import Posterior, learned, posterior
from urdyn.types import Array, Index

SURE = 3.0  # gain of log likelihood that another kind of effect must bring
DOUBT = 3.0  # standard deviations by which claims must fail before intervals are widened


@dataclass(frozen=True)
class Model:
    """A choice of unknowns, and their prior."""

    name: str
    columns: Index  # of all unknowns
    precision: Array  # of the prior, one each


@dataclass(frozen=True)
class Trial:
    """A model fitted to all poses, and to all but one region, region by region."""

    model: Model
    posterior: Posterior  # of the model's columns, by all poses; as wide as `excess` demands
    losses: Array  # (K,) minus log likelihood of each region, held out
    rms: Array  # (K,) of place in the region that was held out [m]
    excess: float  # variance of predictions there over what the posterior claims; 1: as claimed


def held_out(parts: Sequence[Moments], model: Model, offset: Array, noise: Array) -> Trial:
    """The model's trial on regions whose moments are `parts`.

    Args:
        offset: from where the moments were taken to the prior's mean, all unknowns.
        noise: to begin with, of place [m] and turn [rad].
    """
    whole, at = total(parts), offset[model.columns]
    found = learned(whole.only(model.columns), model.precision, at, noise)
    losses, rms, squares, claimed = [], [], 0.0, 0.0
    for part in parts:
        seen, unseen = (whole - part).only(model.columns), part.only(model.columns)
        without = posterior(seen, model.precision, at, found.noise)
        left = unseen.squares(without.mean)
        losses.append(_loss(left, part.count, found.noise))
        rms.append(float(np.sqrt(3.0 * left[0] / part.count[0])))
        squares += float((left / found.noise**2)[part.count > 0.0].sum())
        claimed += float((np.tensordot(found.noise**-2.0, unseen.H, axes=1) * without.cov).sum())
    excess = _excess(squares, claimed, float(whole.count.sum()))
    wide = found.noise * np.sqrt(excess)  # data count for so much less, the prior for what it is
    cov = posterior(whole.only(model.columns), model.precision, at, wide).cov
    return Trial(model, replace(found, cov=cov), np.array(losses), np.array(rms), excess)


def _excess(squares: float, claimed: float, count: float) -> float:
    """Variance of held-out predictions over what was claimed, where chance does not explain it."""
    surplus = squares - count
    return surplus / claimed if surplus - claimed > DOUBT * np.sqrt(2.0 * count) else 1.0


def _loss(squares: Array, count: Array, noise: Array) -> float:
    """Minus log likelihood of place and turn in a region, at the noise that they show there."""
    known = count > 0.0
    shown = np.maximum(squares[known] / count[known], noise[known] ** 2)
    return float(0.5 * (count[known] * np.log(shown)).sum())


def best(trials: Sequence[Trial]) -> Trial:
    """The trial that held-out regions prefer; they come poorest first, and ties stay poor."""
    chosen = trials[0]
    for trial in trials[1:]:
        gain = chosen.losses - trial.losses
        if gain.sum() > SURE and 2 * (gain > 0.0).sum() > len(gain):
            chosen = trial
    return chosen
