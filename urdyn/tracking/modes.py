"""The three modes of the paper's Table IV, side by side."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from urdyn.estimate import Filter
from urdyn.identify.fit import Fit
from urdyn.signal import Sample
from urdyn.tracking.belief.blocks import Blocks
from urdyn.tracking.belief.physical import quantities
from urdyn.tracking.step.tracker import Tracker
from urdyn.types import NORMAL90, Array

LONGEST = 16  # samples that a joint may wait for in realtime mode
# These filters are for a robot's slices only.
QUICKER = {
    "simplified": cast(Filter[Any], Blocks()),
    "realtime": cast(Filter[Any], Blocks(LONGEST)),
}
MODES = {
    "full": "joint covariance of all states, every sample",
    "simplified": "drives independent given bodies, health and gains, every sample",
    "realtime": f"the same, and joints whose currents tell little wait for up to {LONGEST} samples",
}


@dataclass(frozen=True)
class Mode:
    """What a mode cost and estimated."""

    mean: Mapping[str, float]
    sd: Mapping[str, float]
    rate_hz: float
    p99_ms: float


@dataclass(frozen=True)
class Loss:
    """A mode compared with full."""

    faster: float  # [-] updates per second, over full's
    rmse: float  # [-] error over full's; NaN where the truth is not known
    apart: float  # [-] root mean square difference from full, in full's sd
    coverage: float  # [-] share of 90 % intervals that hold the truth; NaN where it is not known


def mode_of(filter: Filter[Any]) -> str:
    """Name of a filter's mode."""
    if not isinstance(filter, Blocks):
        return "full"
    return "realtime" if filter.longest > 1 else "simplified"


def side_by_side(fit: Fit, full: Filter[Any], samples: Sequence[Sample]) -> dict[str, Mode]:
    """All modes on one log; `full` is the filter of the full mode."""
    period = float(np.median(np.diff([sample.t for sample in samples])))
    filters: dict[str, Filter[Any]] = {"full": full, **QUICKER}
    return {name: _run(Tracker(fit, each, period), samples) for name, each in filters.items()}


def losses(
    modes: Mapping[str, Mode], names: Sequence[str], truth: Mapping[str, float]
) -> dict[str, Loss]:
    """Every mode compared with full, over the quantities `names`, whose truth may be unknown."""
    full, known = modes["full"], [name for name in names if name in truth]
    actual = _of(truth, known)
    size = np.where(actual == 0.0, 1.0, np.abs(actual))
    best = (_of(full.mean, known) - actual) / size
    found = {}
    for name, mode in modes.items():
        apart = (_of(mode.mean, names) - _of(full.mean, names)) / _of(full.sd, names)
        error = (_of(mode.mean, known) - actual) / size
        held = np.abs(error * size) < NORMAL90 * _of(mode.sd, known)
        found[name] = Loss(
            mode.rate_hz / full.rate_hz,
            float(np.sqrt(np.sum(error**2) / np.sum(best**2))) if known else np.nan,
            float(np.sqrt(np.mean(apart**2))),
            float(np.mean(held)) if known else np.nan,
        )
    return found


def _of(values: Mapping[str, float], names: Sequence[str]) -> Array:
    return np.array([values[name] for name in names])


def _run(tracker: Tracker[Any], samples: Sequence[Sample]) -> Mode:
    """Run one mode, from the commissioned arm to the log's end."""
    of, state, took = quantities(tracker.fit, tracker.currents), tracker.init(), []
    for sample in samples:
        begin = time.perf_counter()
        state, _ = tracker.step(state, sample)
        took.append(time.perf_counter() - begin)
    mean, sd = of.of(tracker.filter.belief(state.belief))
    means, sds = (dict(zip(of.names, x.tolist(), strict=True)) for x in (mean, sd))
    return Mode(means, sds, len(took) / sum(took), 1e3 * float(np.quantile(took, 0.99)))
