"""What changes add to innovations, shape by shape, also where values are missing.

A change of k^g or exp(k / T) adds h to innovations: what an autoregression does not predict of it.
A level that is off adds 1. Across a gap, less or more is predicted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from urdyn.faults.gaps import Crossing
from urdyn.faults.whiten import Baseline
from urdyn.types import Array

POWERS = (0.0, 0.5, 1.0, 2.0, 3.0)  # g: a step, wear-in, a ramp, accelerating wear
TIMES = 2.0 ** np.arange(5.0, 14.5, 0.5)  # [steps] in which an exponential grows e-fold, T
RAMP = POWERS.index(1.0)


class Shapes(NamedTuple):
    """One number for each shape and stream, or several of them in leading axes."""

    powers: Array  # (..., G, A, n) of G powers from A onsets
    exponentials: Array  # (..., T, n) per unit of their present value
    level: Array  # (..., n) of a level that is off, per unit of its error in innovations


def none(baseline: Baseline, candidates: int) -> Shapes:
    """Zeros at the last p steps, for so many onsets."""
    p, n = baseline.order, baseline.streams
    sizes = (len(POWERS), candidates), (len(TIMES),), ()
    return Shapes(*(np.zeros((p, *size, n)) for size in sizes))


def unbroken(baseline: Baseline, age: Array) -> Shapes:
    """h of onsets of these ages (A,) [steps], where nothing is missing."""
    return Shapes(grown(baseline, age), exponential(baseline), np.ones(baseline.streams))


def grown(baseline: Baseline, age: Array) -> Array:
    """h of powers, of ages (A,) [steps], (G, A, n)."""
    k = np.maximum(age[:, None] - np.arange(baseline.order + 1.0), 0.0)
    passed = np.column_stack([np.ones(baseline.streams), -baseline.coefficients])
    return np.stack([np.where(k > 0.0, k**power, 0.0) for power in POWERS]) @ passed.T


def exponential(baseline: Baseline) -> Array:
    """h of exponentials that are 1 now, (T, n)."""
    lag = np.arange(1.0, baseline.order + 1.0)
    return np.asarray(1.0 - np.exp(-lag / TIMES[:, None]) @ baseline.coefficients.T)


def carried(
    baseline: Baseline, over: Shapes, h: Shapes, by: Crossing | None
) -> tuple[Shapes, Shapes]:
    """Shapes across a step: as `Bridge.carried` returns them, (p, ...) and (...)."""
    if by is None:  # all was measured, and `over` is zeros
        return over, h
    pairs = [baseline.bridge.carried(*each, by) for each in zip(over, h, strict=True)]
    later, left = zip(*pairs, strict=True)
    faded = np.exp(-1.0 / TIMES)[:, None]  # what was 1 is less a step later
    return Shapes(*later)._replace(exponentials=faded * later[1]), Shapes(*left)
