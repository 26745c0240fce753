"""Onset, shape and rate of a growth: regressions, onset by onset and power by power.

    e_t = r h(t - t0) + b + noise,    h(k) = k^g - sum_j a_j max(k - j, 0)^g,   k = t - t0 > 0

is a regression with a kink at t0, r in baseline spreads per step^g, whatever the unit: a power g of
1 is a ramp, of 0 a step; growth slows down between them and accelerates above. Given onset and
power, the pace r is Gaussian with the sums S1 = sum h e and S2 = sum h^2, truncated at zero; b, the
error of the baseline's level, is the same for all, and removed by H = sum h. So paces need no grid;
recent onsets are all kept and older ones ever more sparsely, so that any length of history fits.
After a missing row, h and the effect of b are propagated as the values are (`urdyn.faults.shapes`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from urdyn.faults.alternatives import CLIP
from urdyn.faults.gaps import Past
from urdyn.faults.robust import SQUARE
from urdyn.faults.shapes import POWERS, RAMP, TIMES, Shapes, carried, none, unbroken
from urdyn.faults.wander import STEPS, Walks, set_out, walked
from urdyn.faults.whiten import Baseline, beside, given_baseline
from urdyn.given import given_count, given_step
from urdyn.types import Array, Mask, freeze

CANDIDATES = 160  # onsets kept
FADED = np.exp(-np.array([[1.0], [2.0], [1.0]]) / TIMES)[:, :, None]  # decay over a step, (3, T, 1)
MEMORY = 1000.0  # [steps] over which the spread of innovations is averaged
GATE = 4.0  # [spread] from its neighbours' median, beyond which an innovation is an outlier
NEIGHBOURS = 5  # innovations in that median, including the newest


@dataclass(frozen=True, eq=False)
class Kinks:
    """Every onset kept, and the regressions from it on for G powers."""

    t: int  # [steps] so far
    past: Past
    over: Shapes  # in what is expected at the last p steps, newest first, (p, ...)
    recent: Array  # (NEIGHBOURS, n) [spread] innovations; NaN before the first
    onset: Array  # (A,) [step] last one without the fault; inf: not yet used
    mass: Array  # (A,) [steps] that it stands for
    S: Array  # (3, G, A, n) S1 = sum of h e, S2 = sum of h², H = sum of h w; w b is what b adds
    K: Array  # (2, A, n) sums of k h and h of a ramp, over steps unaffected by a gap
    P: Array  # (A, A, n) sum of h h' of two ramps, over the others; (0, 0, n) before the first
    X: Array  # (3, T, n) S of exponentials, which have no onset, per unit of their present value
    E: Array  # (n,) sum of w e
    N: Array  # (n,) sum of w²
    stride: Array  # (2, n) sum of squared differences of successive e [healthy mean]; their number
    walks: Array  # (7, Q, A, n) of ramps whose level also walks (`Walks`)

    def __post_init__(self) -> None:
        freeze(self, *(x.name for x in fields(self) if x.name not in ("t", "past", "over")))


def kinks(baseline: Baseline, candidates: int = CANDIDATES) -> Kinks:
    """The state before any data; candidates: onsets kept, 3 or more."""
    # An onset is dropped only from between two others.
    candidates = given_count(candidates, "candidates", 3)
    n = given_baseline(baseline).streams
    return Kinks(
        t=0,
        past=baseline.bridge.init(),
        over=none(baseline, candidates),
        recent=np.full((NEIGHBOURS, n), np.nan),
        onset=np.full(candidates, np.inf),
        mass=np.zeros(candidates),
        S=np.zeros((3, len(POWERS), candidates, n)),
        K=np.zeros((2, candidates, n)),
        P=np.zeros((0, 0, n)),
        X=np.zeros((3, len(TIMES), n)),
        E=np.zeros(n),
        N=np.zeros(n),
        stride=np.zeros((2, n)),
        walks=np.zeros((len(Walks._fields), len(STEPS), candidates, n)),
    )


def follow(baseline: Baseline, state: Kinks, observed: Array) -> Kinks:
    """One step: add a candidate onset and update every regression with `observed`, (n,)."""
    observed = given_step(observed, baseline.streams)
    past, left, by = baseline.bridge.crossed(state.past, observed)
    e = left / baseline.spread
    recent = np.vstack([state.recent[1:], e])
    measured = np.isfinite(e) & ~_wild(recent)
    e = np.where(measured, e, 0.0)
    onset, mass, gone = _with_candidate(state)
    k = np.where(np.isfinite(onset), state.t + 1.0 - onset, 0.0)
    over = state.over._replace(powers=_without(state.over.powers, gone))
    over, h = carried(baseline, over, unbroken(baseline, k), by)
    h = Shapes(*(x * measured for x in h))
    S, K, walks = (_without(x, gone) for x in (state.S, state.K, state.walks))
    ramp, w, newest = h.powers[RAMP], h.level, int(np.isfinite(onset).sum())
    plain = np.asarray(by is None or by.v == 1.0)  # nothing was missing, as far as it matters
    precision = state.N + baseline.steps / baseline.inflation**2
    walks[:, :, newest - 1] = set_out(state.E, precision)
    walks[:, :, :newest] = walked(walks[:, :, :newest], e, ramp[:newest], w, measured)
    for total, term in zip(S, _terms(h.powers, w, e), strict=True):
        total += term  # in place: S is the largest by far
    return Kinks(
        t=state.t + 1,
        past=past,
        over=over,
        recent=recent,
        onset=onset,
        mass=mass,
        S=S,
        K=K + np.stack([k[:, None] * ramp, ramp]) * plain,
        P=_paired(state.P, ramp * ~plain, gone),
        X=state.X * FADED + np.stack(_terms(h.exponentials, w, e)),
        E=state.E + w * e,
        N=state.N + w**2,
        stride=state.stride * (1.0 - 1.0 / MEMORY) + _stride(baseline, recent),
        walks=walks,
    )


def _terms(h: Array, w: Array, e: Array) -> tuple[Array, Array, Array]:
    """What a step adds to S1, S2 and H, (..., n) each."""
    return h * e, h**2, h * w


def _paired(P: Array, ramp: Array, gone: int) -> Array:
    """Sums (A, A, n) of products of two ramps, plus those of one step, (A, n)."""
    if not P.size:
        return ramp[:, None] * ramp if ramp.any() else P
    if gone < len(ramp) - 1:  # along both axes
        P = _without(_without(P, gone).reshape(len(P), -1), gone).reshape(P.shape)
    return P + ramp[:, None] * ramp if ramp.any() else P


def followed(baseline: Baseline, series: ArrayLike, candidates: int = CANDIDATES) -> Kinks:
    """The state after a whole series, (N,) or (N, n) [unit]."""
    rows, _ = beside(series, baseline)
    state = kinks(baseline, candidates)
    for row in rows:
        state = follow(baseline, state, row)
    return state


def _wild(recent: Array) -> Mask:
    """Whether the newest innovation lies far from the median of the last ones, (n,)."""
    measured = np.isfinite(recent).all(axis=0)
    middle = np.median(np.where(measured, recent, 0.0), axis=0)
    return np.asarray(measured & (np.abs(recent[-1] - middle) > GATE), dtype=np.bool_)


def _stride(baseline: Baseline, recent: Array) -> Array:
    """Square of the newest difference, clipped as the baseline's, and if measured, (2, n)."""
    step = (recent[-1] - recent[-2]) / (np.sqrt(2.0) * baseline.stride)
    measured = np.isfinite(step)
    return np.stack([np.clip(np.where(measured, step, 0.0), -CLIP, CLIP) ** 2 / SQUARE, measured])


def _with_candidate(state: Kinks) -> tuple[Array, Array, int]:
    """Onsets and masses with a new candidate, and the index of the one that it replaced.

    The last index, an unused one, while there is room. Else the candidate closest to its neighbours
    for its age is dropped, and they share its mass.
    """
    onset, mass = state.onset.copy(), state.mass.copy()
    used, gone = int(np.isfinite(onset).sum()), len(onset) - 1
    if used == len(onset):
        age = state.t + 1.0 - onset
        gone = 1 + int(np.argmin((onset[2:] - onset[:-2]) / age[1:-1]))
        mass[[gone - 1, gone + 1]] += 0.5 * mass[gone]
        used -= 1
        for kept in (onset, mass):
            kept[gone:-1] = kept[gone + 1 :]
    onset[used], mass[used] = state.t, 1.0
    return onset, mass, gone


def _without(sums: Array, gone: int) -> Array:
    """Sums (..., A, n) with one onset removed, and an empty place at the end."""
    kept = np.empty_like(sums)
    kept[..., :gone, :] = sums[..., :gone, :]
    kept[..., gone:-1, :] = sums[..., gone + 1 :, :]
    kept[..., -1, :] = 0.0
    return kept
