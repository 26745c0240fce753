"""The short way: a plain series, what it was like when healthy, and a promise; an alarm or none."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import UrdynError
from urdyn.faults.detector import Detection, Detector, run
from urdyn.faults.sequential import ShiryaevRoberts
from urdyn.faults.whiten import Baseline, learn_baseline
from urdyn.faults.whitened import Whitened
from urdyn.types import Array


def detect(
    series: ArrayLike,
    baseline: Baseline | ArrayLike,
    promise: float = 10_000.0,
    *,
    side: ArrayLike = 0.0,
    tolerance: ArrayLike = 0.0,
    detector: Detector[Any] | None = None,
) -> Detection:
    """Find a change in tracked parameters, with at most one false alarm in `promise` steps.

    Args:
        series: (N,) or (N, n) of n streams, in any unit, NaN where nothing was measured.
        baseline: the same streams while healthy, 1000 steps or more; or what was learnt from them.
        promise: steps to a false alarm over all streams together, on the average, at least.
        side: of each stream: +1 where only a rise is a fault, -1 a fall, 0 both.
        tolerance: change of each stream's level, in its unit, that is no fault.
        detector: of standardised innovations; ShiryaevRoberts with these settings if None.

    Example: `detect(friction, friction_when_new, promise=10_000).alarm` is a row, or None.
    """
    rows = np.asarray(series, dtype=np.float64)
    rows = rows[:, None] if rows.ndim == 1 else rows
    healthy = baseline if isinstance(baseline, Baseline) else learn_baseline(np.asarray(baseline))
    if rows.ndim != 2 or rows.shape[1] != healthy.streams:
        raise UrdynError(
            f"the series is {rows.shape}, and the baseline has {healthy.streams} streams: "
            "give steps x streams of the same streams"
        )
    if detector is None:
        detector = ShiryaevRoberts(
            promise, side=_each(side), tolerance=healthy.whitened(_each(tolerance))
        )
    return run(Whitened(healthy, detector), rows)


def _each(value: ArrayLike) -> Array:
    return np.atleast_1d(np.asarray(value, dtype=np.float64))
