"""When a ramp began, and how steep it is: the posterior, onset by onset.

    e_t = r h(t - t0) + noise,    h(k) = k - sum_j a_j max(k - j, 0),   k = t - t0 >= 0

is a regression through its kink, r in spreads of the baseline a step, whatever the unit. Given the
onset t0, the rate r is Gaussian with the sums S1 = sum h e, S2 = sum h^2, and cut off at zero. So
rates need no grid; onsets are remembered one by one while they are recent, and the older the
sparser, so that any length of history fits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from urdyn.faults.whiten import Baseline, beside
from urdyn.given import given_count
from urdyn.types import Array, Mask, frozen

CANDIDATES = 160  # onsets remembered
GATE = 4.0  # [spread] of an innovation from the median of its neighbours: an outlier tells no rate
NEIGHBOURS = 5  # innovations of that median, the newest among them


@dataclass(frozen=True, eq=False)
class Kinks:
    """Every onset that is remembered, and the regression from it on."""

    t: int  # [steps] behind us
    past: Array  # (p, n) [unit] oldest first
    recent: Array  # (NEIGHBOURS, n) [spread] innovations; NaN before the first
    onset: Array  # (A,) [step] last one without the fault; inf: not yet used
    mass: Array  # (A,) [steps] that it stands for
    S1: Array  # (A, n)
    S2: Array  # (A, n)

    def __post_init__(self) -> None:
        for name in ("past", "recent", "onset", "mass", "S1", "S2"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def kinks(baseline: Baseline, candidates: int = CANDIDATES) -> Kinks:
    """Nothing seen yet; candidates: onsets that are remembered, 3 or more."""
    given_count(candidates, "candidates", 3)  # the one that is missed least lies between two
    n, empty = baseline.streams, np.zeros((candidates, baseline.streams))
    past = np.full((baseline.order, n), np.nan)
    recent = np.full((NEIGHBOURS, n), np.nan)
    return Kinks(0, past, recent, np.full(candidates, np.inf), np.zeros(candidates), empty, empty)


def follow(baseline: Baseline, state: Kinks, observed: Array) -> Kinks:
    """One step on: a new candidate, and every regression learns from what was observed, (n,)."""
    e = baseline.innovation(state.past, observed) * baseline.inflation
    recent = np.vstack([state.recent[1:], e])
    state = _with_candidate(state)
    told = np.isfinite(e) & ~_wild(recent)
    h = _shape(baseline, state.t + 1.0 - state.onset)
    h = np.where(told, h, 0.0)
    past = np.vstack([state.past, observed])[1:] if baseline.order else state.past
    return replace(
        state,
        t=state.t + 1,
        past=past,
        recent=recent,
        S1=state.S1 + h * np.where(told, e, 0.0),
        S2=state.S2 + h**2,
    )


def followed(baseline: Baseline, series: ArrayLike, candidates: int = CANDIDATES) -> Kinks:
    """After a whole series, (N,) or (N, n) [unit]."""
    rows, _ = beside(series, baseline)
    state = kinks(baseline, candidates)
    for row in rows:
        state = follow(baseline, state, row)
    return state


def _shape(baseline: Baseline, age: Array) -> Array:
    """h of ages (A,), (A, n) [steps]; zero for onsets not yet used."""
    k = np.where(np.isfinite(age), age, 0.0)[:, None]
    lag = np.arange(1.0, baseline.order + 1.0)
    return np.asarray(k - np.maximum(k - lag, 0.0) @ baseline.coefficients.T)


def _wild(recent: Array) -> Mask:
    """The newest innovation lies far from the median of the last ones, (n,)."""
    told = np.isfinite(recent).all(axis=0)
    middle = np.median(np.where(told, recent, 0.0), axis=0)
    return np.asarray(told & (np.abs(recent[-1] - middle) > GATE), dtype=np.bool_)


def _with_candidate(state: Kinks) -> Kinks:
    """An onset now, in an empty place or in that of the one which is missed least."""
    onset, mass = state.onset.copy(), state.mass.copy()
    S1, S2 = state.S1.copy(), state.S2.copy()
    used = int(np.isfinite(onset).sum())
    if used == len(onset):
        age = state.t + 1.0 - onset
        gone = 1 + int(np.argmin((onset[2:] - onset[:-2]) / age[1:-1]))
        mass[gone - 1] += 0.5 * mass[gone]
        mass[gone + 1] += 0.5 * mass[gone]
        for kept in (onset, mass, S1, S2):
            kept[gone:-1] = kept[gone + 1 :]
        used -= 1
    onset[used], mass[used], S1[used], S2[used] = state.t, 1.0, 0.0, 0.0
    return replace(state, onset=onset, mass=mass, S1=S1, S2=S2)
