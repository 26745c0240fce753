"""What passes slowly in the noise of a current: how much there is, and how to see past it.

After the filter that makes the quick part white, with h the slow part's gain over the noise's sd,

    y_t = h s_t + w_t,    s_t = keep s_{t-1} + sqrt(1 - keep²) u_t,    w, u ~ N(0, 1)

Kalman's innovations of y are white: a filter with a gain that settles within some samples.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from urdyn.types import Array

MEMORY = 1.2  # [s] of what passes slowly, as on recordings of real arms
SHARES = (0.0, *np.geomspace(0.005, 0.64, 22).tolist())  # of the variance that may be slow
NONE = 0.5  # [-] how likely it is, before any data, that nothing is slow
SEGMENT = 8192  # samples of a periodogram at most
BINS = 120  # of its frequencies, by their logarithm
SETTLED = 1e-9  # relative change of the gain from sample to sample

# Of a share of the variance that is slow: regression of the rest, and the variance that it leaves.
Quick = Callable[[float], tuple[Array, float]]


def forgotten(step: float) -> float:
    """What is left of the slow part after `step` [s]."""
    return float(np.exp(-step / MEMORY))


def without_slow(y: Array, h: float, keep: float) -> Array:
    """Innovations of the rows y (N, ...), in units in which w keeps its variance."""
    if h == 0.0 or not len(y):
        return y
    from scipy.signal import lfilter  # heavy

    white, s, P = np.empty_like(y), np.zeros(y.shape[1:]), 1.0
    for t in range(len(y)):
        S = h * P * h + 1.0
        gain = P * h / S
        white[t] = (y[t] - h * s) / np.sqrt(S)
        s = keep * (s + gain * (y[t] - h * s))
        before, P = P, keep * (P - gain * h * P) * keep + 1.0 - keep**2
        if abs(P - before) < SETTLED * P:
            break
    done, root = t + 1, np.sqrt(S)
    # From here on: s_t = theta s_{t-1} + keep gain y_{t-1}, innovation y_t - h s_t.
    theta = keep * (1.0 - gain * h)
    if done < len(y):
        zi = np.expand_dims(-h * s, 0)
        rest, _ = lfilter([1.0, -theta - keep * gain * h], [1.0, -theta], y[done:], axis=0, zi=zi)
        white[done:] = rest / root
    return white


def share_of(stretches: list[Array], quick: Quick, keep: float) -> float:
    """Share of the variance that is slow, by the likelihood of the spectrum. [Whittle1953]_

    The mean of what is likely, as each of SHARES but the first was as likely before: a log has few
    independent values of what passes slowly, and the likeliest share is more often too small than
    too large.
    """
    w, seen, count = _spectrum(stretches)
    power = float(seen @ count / count.sum())
    slow = (1.0 - keep**2) / np.abs(1.0 - keep * np.exp(-1j * w)) ** 2

    def misfit(share: float) -> float:
        ar, left = quick(share)
        turn = np.exp(-1j * np.outer(w, np.arange(1, len(ar) + 1)))
        density = left / np.abs(1.0 - turn @ ar) ** 2 + share * power * slow
        return float(count @ (np.log(density) + seen / density))

    misfits = np.array([misfit(share) for share in SHARES])
    before = np.r_[NONE, np.full(len(SHARES) - 1, (1.0 - NONE) / (len(SHARES) - 1))]
    weights = before * np.exp(misfits.min() - misfits)
    return float(weights @ np.array(SHARES) / weights.sum())


def _spectrum(stretches: list[Array]) -> tuple[Array, Array, Array]:
    """Frequencies [rad], mean power there and how many values that is of."""
    parts = [
        part
        for r in stretches
        for part in np.array_split(r, -(-len(r) // SEGMENT))
        if len(part) > 1
    ]
    found = [np.abs(np.fft.rfft(part)[1:]) ** 2 / len(part) for part in parts]
    power = np.concatenate(found)
    w = np.concatenate([np.pi * np.arange(1, len(f) + 1) / len(f) for f in found])
    edges = np.geomspace(w.min(), np.pi, BINS)
    at = np.digitize(w, edges)
    count = np.bincount(at).astype(float)
    some = count > 0.0
    means = [np.bincount(at, weights=x)[some] / count[some] for x in (w, power)]
    return means[0], means[1], count[some]
