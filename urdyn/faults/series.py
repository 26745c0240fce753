"""The short way: from a series, its healthy past and a promise to an alarm, or none."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from urdyn.errors import InputError
from urdyn.faults.algorithm2 import Algorithm2
from urdyn.faults.detector import Detection, Detector, run
from urdyn.faults.sequential import ShiryaevRoberts
from urdyn.faults.whiten import Baseline, beside
from urdyn.faults.whitened import Whitened
from urdyn.given import given_side, given_tolerance

PROMISE = 10_000.0  # [steps] unless asked for


def detect(
    series: ArrayLike,
    baseline: Baseline | ArrayLike,
    promise: float = PROMISE,
    *,
    side: ArrayLike = 0.0,
    tolerance: ArrayLike = 0.0,
    detector: Detector[Any] | None = None,
) -> Detection:
    """Find a change in tracked parameters, with at most one false alarm in `promise` steps.

    Args:
        series: (N,) or (N, n) of n streams, in any unit, NaN where nothing was measured.
        baseline: the same streams while healthy, 1000 steps or more; or a `Baseline` of them.
            Skew, a restless spread and swings that it shows are no faults.
        promise: mean steps to a false alarm over all streams together, at least.
        side: of each stream: +1 where only a rise is a fault, -1 a fall, 0 both.
        tolerance: change of each stream's level, in its unit, that is no fault: how far it strays
            from the baseline's where a short baseline does not show it.
        detector: of standardised innovations, with settings of its own; ShiryaevRoberts with these
            if None. An `Algorithm2` is given the series as it is: baseline and promise are in its
            thresholds.

    Raises:
        InputError: series and baseline have different streams, or a setting cannot be used.

    Example: `detect(friction, friction_when_new, promise=10_000).alarm` is a row, or None.
    """
    rows, healthy = beside(series, baseline)
    ways, slack = given_side(side, healthy.streams), given_tolerance(tolerance, healthy.streams)
    if detector is None:
        detector = ShiryaevRoberts(promise, side=ways, tolerance=healthy.whitened(slack))
    elif promise != PROMISE or ways.any() or slack.any():
        raise InputError("promise, side and tolerance are the detector's own; give them to it")
    if isinstance(detector, Algorithm2):
        return run(detector, rows)
    return run(Whitened(healthy, detector), rows)
