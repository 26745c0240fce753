"""Which change explains the bank's data: the evidence of each kind and joint.

A change of kind h has a size delta ~ N(0, D_h), of one sign where the kind has one. Its evidence
against the healthy arm is the likelihood ratio averaged over that size, over step and ramp, and
over onsets; summed over onsets it is the Shiryaev-Roberts statistic, whose mean over all kinds
grows by one per block while the arm is healthy: the threshold is the promise itself [Shin2024]_.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from urdyn.diagnose.kinds.likelihood_ratio import log_ratio
from urdyn.diagnose.kinds.rules import SHAPES, SlowKind
from urdyn.diagnose.kinds.suspects import Suspect, Suspects
from urdyn.diagnose.slow.onsets import Bank
from urdyn.types import Array, Index

SIZES = (1.0, 0.2)  # of a step, relative to the expected size
RATES = (60.0, 600.0, 3600.0, 18000.0)  # [s] in which a ramp makes a change of the expected size
SCALES = {"step": SIZES, "ramp": tuple(1.0 / tau for tau in RATES)}  # of it; a ramp's [1/s]
FINE = 0.05  # resolution of a change's onset, relative to the time between the bank's


@dataclass(frozen=True, eq=False)
class Explanation:
    """A change, and how well it explains the data."""

    suspect: Suspect
    t: float  # [s] now
    evidence: float  # log of the sum over onsets and shapes
    shape: str  # the likeliest
    onset: float  # [s] the bank's, median of the first one to show it
    shown: tuple[float, float]  # [s] 5 and 95 % of the same
    began: tuple[float, float, float]  # [s] 5, 50 and 95 %
    size: float  # present change of the first state
    size_sd: float
    rate: float  # [1/s]; 0 for a step
    rate_sd: float
    older: bool  # it may be older than the run

    @property
    def large(self) -> bool:
        """Large enough to be reported, and of its kind's sign."""
        kind = self.suspect.kind
        size = kind.sign * self.size if kind.sign else abs(self.size)
        return bool(size > kind.least * self.suspect.unit)


def evidence(bank: Bank, kind: SlowKind, places: Index, sd: Array) -> Array:
    """Log-likelihood ratios of a kind's suspects; -inf where there is none.

    Args:
        places: of g suspects, (g, r).
        sd: of their changes, (g, r).

    Returns:
        (g, shapes 2, scales, onsets m).
    """
    told = np.full((len(places), 2, len(RATES), len(bank.onset)), -np.inf)
    C = np.moveaxis(bank.C[..., places[:, :, None], places[:, None, :]], 2, 1)  # (2, g, m, r, r)
    d = np.moveaxis(bank.d[..., places], 2, 1)
    for s, shape in enumerate(SHAPES):
        if shape in kind.shapes:
            for k, scale in enumerate(SCALES[shape]):
                told[:, s, k] = log_ratio(C[s], d[s], scale * sd[:, None], kind.sign)
            told[:, s] -= np.log(len(SCALES[shape]) * len(kind.shapes))
    return told


def ratios(bank: Bank, of: Suspects) -> Array:
    """Log of each suspect's likelihood ratio by onset, summed over shapes and sizes, (h, m)."""
    told = np.full((len(of.each), len(bank.onset)), -np.inf)
    if not told.size:  # a bank that has just begun
        return told
    for kind, at, places, sd in of.by_kind:
        told[at] = logsumexp(evidence(bank, kind, places, sd), axis=(1, 2))
    return told


def gathered(bank: Bank, told: Array, older: float = 0.0) -> Array:
    """Evidence of each suspect over all onsets, (h,): log of Shiryaev-Roberts sums.

    Args:
        told: `ratios`, (h, m).
        older: blocks that stand for onsets before the first one.
    """
    if not len(bank.onset):
        return np.full(len(told), -np.inf)
    counted = bank.weight.copy()
    counted[0] += older * bank.oldest
    return np.asarray(logsumexp(told + np.log(counted), axis=1))


def explanation(bank: Bank, suspect: Suspect) -> Explanation:
    """A suspect's change, if it is there."""
    told = _by_onset(bank, suspect)
    total = float(logsumexp(told))
    by_onset = np.exp(logsumexp(told, axis=(0, 1)) - total)
    best = _likeliest(bank, suspect, told)
    delta, spread = float(best.delta[0]), float(np.sqrt(best.cov[0, 0]))
    grows = best.shape == "ramp"
    lo, middle, hi = (_quantile(bank.onset, by_onset, share) for share in (0.05, 0.5, 0.95))
    began = _began(np.append(bank.onset, bank.t), by_onset)
    older = bank.oldest and bool(middle == bank.onset[0])
    if older:
        began = (middle, middle, began[2])
    return Explanation(
        suspect=suspect,
        t=bank.t,
        evidence=total,
        shape=best.shape,
        onset=middle,
        shown=(lo, hi),
        began=began,
        size=delta * best.age,
        size_sd=spread * best.age,
        rate=delta if grows else 0.0,
        rate_sd=spread if grows else 0.0,
        older=older,
    )


def supposed(bank: Bank, suspect: Suspect, E: Array) -> Bank:
    """The bank with its arm changed by this suspect's likeliest change.

    Args:
        E: the directions of all faults, (N, p).
    """
    best, at = _likeliest(bank, suspect, _by_onset(bank, suspect)), suspect.places
    filtered = bank.X[:, SHAPES.index(best.shape), best.m, at]
    missed = best.age * E[:, at] - filtered  # per unit of change, by the filter
    x = bank.x + missed @ best.delta
    return replace(bank, x=x, P=bank.P + missed @ best.cov @ missed.T)


def _by_onset(bank: Bank, suspect: Suspect) -> Array:
    """Evidence of a suspect by shape, scale and onset, (2, scales, m)."""
    (told,) = evidence(bank, suspect.kind, suspect.places[None], suspect.sd[None])
    return np.asarray(told + np.log(bank.weight))


@dataclass(frozen=True, eq=False)
class _Likeliest:
    """The likeliest of a suspect's changes."""

    shape: str
    m: int  # which onset
    cov: Array  # (r, r) of the change: a step's size, a ramp's rate
    delta: Array  # (r,) mean of that
    age: float  # factor to the size now: [s] since a ramp's onset, 1 for a step


def _likeliest(bank: Bank, suspect: Suspect, told: Array) -> _Likeliest:
    """The likeliest shape, scale and onset of a suspect's change.

    Args:
        told: evidence of each, (2, scales, m).
    """
    s, scale, m = (int(k) for k in np.unravel_index(int(np.argmax(told)), told.shape))
    shape, at = SHAPES[s], suspect.places
    sd = suspect.sd * SCALES[shape][scale]
    cov = np.linalg.inv(bank.C[s, m][at[:, None], at] + np.diag(sd**-2.0))
    age = float(bank.t - bank.onset[m]) if shape == "ramp" else 1.0
    return _Likeliest(shape, m, np.asarray(cov), np.asarray(cov @ bank.d[s, m][at]), age)


def _quantile(values: Array, share: Array, level: float) -> float:
    return float(values[min(int(np.searchsorted(np.cumsum(share), level)), len(values) - 1)])


def _began(edges: Array, share: Array) -> tuple[float, float, float]:
    """When a change began, 5, 50 and 95 %; between two onsets it looks like one at the nearer.

    So each onset covers the time to its neighbours, and the nearest most.

    Args:
        edges: onsets, and the end of the last block, (m + 1,) [s].
        share: probability of each to be the first to show the change, (m,).
    """
    lasting = np.diff(edges)
    density = np.append(share / (lasting + np.append(0.0, lasting[:-1])), 0.0)
    t = np.interp(np.arange(0.0, len(lasting) + 0.5 * FINE, FINE), np.arange(len(edges)), edges)
    of_t = np.interp(t, edges, density)
    before = np.append(0.0, np.cumsum(0.5 * (of_t[1:] + of_t[:-1]) * np.diff(t)))
    lo, middle, hi = np.interp(np.array([0.05, 0.5, 0.95]) * before[-1], before, t)
    return float(lo), float(middle), float(hi)
