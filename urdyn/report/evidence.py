"""Pooled scores of several logs, and which of the logs the fit has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urdyn.identify import Fit, Score
from urdyn.types import Array, Source

SEEN, PARTLY, UNSEEN = "seen in training", "partly seen in training", "held out"


@dataclass(frozen=True, eq=False)
class Pooled:
    """Scores of several logs, as if they were one; NaN where none has a value."""

    ours: Array  # (J,) relative error of the model [%]
    controller: Array  # (J,) of the controller's own target_current [%]
    floor: Array  # (J,) share of the current that no smooth model can predict [%]
    standing: Array  # (J,) share of samples in which the joint is at rest [-]
    moving: Array  # (J,) relative error of the model in the others [%]
    coverage: Array  # (J,) share of samples inside the 90 % interval [-]
    unseen: bool  # no row of these logs was trained on


def seen(fit: Fit, source: Source) -> str:
    """Whether the fit was trained on the rows of this source."""
    shared = [_overlap(trained, source) for trained in fit.sources if _same(trained, source)]
    if source in fit.sources or max(shared, default=0.0) >= 1.0:
        return SEEN
    return PARTLY if max(shared, default=0.0) > 0.0 else UNSEEN


def _same(a: Source, b: Source) -> bool:
    """The same bytes or, without a hash, the same name: nothing counts as held out by mistake."""
    return a.sha256 == b.sha256 and (bool(a.sha256) or a.path == b.path)


def _overlap(trained: Source, source: Source) -> float:
    """Share of the rows of `source` that are among those of `trained`; whole files are one."""
    if trained.rows is None:
        return 1.0
    first, last = source.rows or (0, np.inf)
    both = min(trained.rows[1], last) - max(trained.rows[0], first)
    return float(max(both, 0.0) / max(last - first, 1.0)) if np.isfinite(last) else 0.5


def telling(fit: Fit, scores: Sequence[Score]) -> list[Score]:
    """The scores that a judgement rests on: of held-out logs, or of all where none is held out."""
    unseen = [score for score in scores if seen(fit, score.log.source) == UNSEEN]
    return unseen or list(scores)


def pool(fit: Fit, scores: Sequence[Score]) -> Pooled:
    """Relative errors pooled by the energy of each log's current, shares by its samples."""
    current = [score.log.joint("actual_current") for score in scores]
    moving = [np.where(s.moves, i, np.nan) for s, i in zip(scores, current, strict=True)]

    def relative(name: str, of: list[Array] = current) -> Array:
        energy = np.array([np.nansum(i**2, axis=0) for i in of])
        return np.sqrt(_mean(np.array([getattr(s, name) for s in scores]) ** 2, energy))

    def share(name: str, of: list[Array]) -> Array:
        samples = np.array([np.isfinite(i).sum(axis=0) for i in of])
        return _mean(np.array([getattr(s, name) for s in scores]), samples)

    return Pooled(
        ours=relative("rre_percent"),
        controller=relative("target_rre_percent"),
        floor=relative("floor_percent"),
        standing=share("standing", current),
        moving=relative("moving_rre_percent", moving),
        coverage=share("coverage90", moving),
        unseen=all(seen(fit, s.log.source) == UNSEEN for s in scores),
    )


def _mean(values: Array, weights: Array) -> Array:
    """Weighted mean over logs of what is finite, (L, J) -> (J,); NaN where nothing is."""
    weights = np.where(np.isfinite(values), weights, 0.0)
    total = weights.sum(axis=0)
    mean = np.sum(np.where(weights > 0.0, values, 0.0) * weights, axis=0) / np.maximum(
        total, 1e-300
    )
    return np.where(total > 0.0, mean, np.nan)


def speed(score: Score) -> Array:
    """Joint velocities of a scored log, (N, J) [rad/s]; from the angles where not recorded."""
    v = score.log.joint("actual_qd")
    if np.isfinite(v).any():
        return v
    return np.asarray(np.gradient(score.log.joint("actual_q"), score.log.t, axis=0))


def residual(score: Score) -> Array:
    """Measured less predicted current, (N, J) [A]."""
    return score.log.joint("actual_current") - score.predicted
