"""Which model holds in regions it has not seen: geometry alone, or with joint effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from urdyn.identify.kinematics.moments import Moments, total
from urdyn.identify.kinematics.posterior import Posterior, learned, posterior
from urdyn.types import Array, Index, Mask

SURE = 3.0  # [nats] gain of likelihood that another kind of effect must bring
DOUBT = 3.0  # standard deviations by which claims must fail before they are widened


@dataclass(frozen=True, eq=False)
class Model:
    """A choice of unknowns, and their prior."""

    name: str
    columns: Index  # of all unknowns
    precision: Array  # of the prior, one each
    guessed: Mask  # those whose prior width was chosen by held-out regions, relative to the noise


@dataclass(frozen=True, eq=False)
class Trial:
    """A model fitted to all poses, and to all but one region, for each region."""

    model: Model
    posterior: Posterior  # of the model's columns, from all poses, widened by `excess`
    losses: Array  # (K,) minus log likelihood of each region, held out
    rms: Array  # (K,) of place in the held-out region [m]
    stripped: Array  # (K,) the same with its geometry alone, base and tool fitted there [m]
    excess: float  # variance of predictions there over the posterior's claim; 1: as claimed


def held_out(
    parts: Sequence[Moments], model: Model, frames: Index, offset: Array, noise: Array
) -> Trial:
    """The model's trial on regions whose moments are `parts`.

    Args:
        frames: indices of base and tool among all unknowns; effects follow them.
        offset: from where the moments were taken to the prior's mean, all unknowns.
        noise: initial, of place [m] and turn [rad].
    """
    whole, at = total(parts), offset[model.columns]
    found = learned(whole.only(model.columns), model.precision, at, noise)
    losses, rms, stripped, squares, claimed = [], [], [], 0.0, 0.0
    for part in parts:
        seen, unseen = (whole - part).only(model.columns), part.only(model.columns)
        without = posterior(seen, model.precision, at, found.noise)
        left = unseen.squares(without.mean)
        losses.append(_loss(left, part.count, found.noise))
        rms.append(float(np.sqrt(3.0 * left[0] / part.count[0])))
        stripped.append(_stripped(part, model.columns, without.mean, frames, found.noise))
        squares += float((left / found.noise**2)[part.count > 0.0].sum())
        claimed += float((np.tensordot(found.noise**-2.0, unseen.H, axes=1) * without.cov).sum())
    excess = _excess(squares, claimed, float(whole.count.sum()))
    # Errors that neighbouring poses share make data count for less; a prior width chosen relative
    # to the noise grows with it.
    precision = np.where(model.guessed, model.precision / excess, model.precision)
    wide = posterior(whole.only(model.columns), precision, at, found.noise * np.sqrt(excess))
    kept = replace(found, cov=wide.cov)
    return Trial(model, kept, np.array(losses), np.array(rms), np.array(stripped), excess)


def _stripped(part: Moments, columns: Index, mean: Array, frames: Index, noise: Array) -> float:
    """RMS of place [m] in a region with a mean's geometry alone, base and tool refitted."""
    x = np.zeros(part.b.shape[1])
    geometry = columns[columns < frames[0]]
    x[geometry] = mean[: len(geometry)]
    sought = np.intersect1d(frames, columns)
    H, b = (np.tensordot(noise**-2.0, m, axes=1) for m in (part.H, part.b))
    x[sought] = np.linalg.lstsq(H[np.ix_(sought, sought)], (b - H @ x)[sought], rcond=None)[0]
    return float(np.sqrt(3.0 * part.squares(x)[0] / part.count[0]))


def _excess(squares: float, claimed: float, count: float) -> float:
    """Variance of held-out predictions over the claimed one, if significant; else 1."""
    surplus = squares - count
    return surplus / claimed if surplus - claimed > DOUBT * np.sqrt(2.0 * count) else 1.0


def _loss(squares: Array, count: Array, noise: Array) -> float:
    """Minus log likelihood of place and turn in a region, at the noise shown there."""
    known = count > 0.0
    shown = np.maximum(squares[known] / count[known], noise[known] ** 2)
    return float(0.5 * (count[known] * np.log(shown)).sum())


def best(trials: Sequence[Trial]) -> Trial:
    """The trial that held-out regions prefer; simplest first, and ties go to the simpler."""
    chosen = trials[0]
    for trial in trials[1:]:
        gain = chosen.losses - trial.losses
        if gain.sum() > SURE and 2 * (gain > 0.0).sum() > len(gain):
            chosen = trial
    return chosen
