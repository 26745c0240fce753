"""Slow noise in a current: how much there is, and how to whiten it.

After the filter that whitens the fast part, with h the slow part's gain over the noise's sd,

    y_t = h s_t + w_t,    s_t = keep s_{t-1} + sqrt(1 - keep²) u_t,    w, u ~ N(0, 1)

the Kalman filter's innovations of y are white, and its gain settles within some samples.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from urdyn.types import Array, frozen

MEMORY = 1.2  # [s] time constant of slow noise, from recordings of real arms
SHARES = (0.0, *np.geomspace(0.005, 0.64, 22).tolist())  # of the variance that may be slow
NONE = 0.2  # [-] prior probability that there is no slow noise
# [-] prior median of its share otherwise: on recordings of a UR10e .07 to .24 by joint. And sd of
# its logarithm, twice that of these recordings, to allow for other arms.
USUAL, UNUSUAL = 0.12, 1.0
BINS = 120  # of frequencies, equal in their logarithm
SETTLED = 1e-9  # relative change of the variance from sample to sample

Complex = NDArray[np.complex128]
# Share of the variance that is slow -> regressions of the rest, with their innovation variances.
Quick = Callable[[float], list[tuple[Array, float]]]


def forgotten(step: float) -> float:
    """Autocorrelation of the slow part after `step` [s]."""
    return float(np.exp(-step / MEMORY))


def without_slow(y: Array, h: float, keep: float) -> Array:
    """Innovations of the rows y (N, ...), scaled so that w keeps its variance."""
    if h == 0.0 or not len(y):
        return y
    from scipy.signal import lfilter  # heavy

    gain, S = (of_row[: len(y)] for of_row in _settling(h, keep))
    done, theta, root = len(gain), keep * (1.0 - gain * h), np.sqrt(S)
    # s_t+1 = theta s_t + keep gain y_t, with the innovation y_t - h s_t.
    seen = (y[:done].T * (keep * gain)).T
    before, s = np.empty_like(seen), np.zeros(y.shape[1:])
    for t in range(done):
        before[t] = s
        s = theta[t] * s + seen[t]
    white = np.empty_like(y)
    white[:done] = ((y[:done] - h * before).T / root).T
    if done < len(y):
        zero, pole = theta[-1] + keep * gain[-1] * h, theta[-1]
        b, zi = np.array([1.0, -zero]) / root[-1], np.expand_dims(-h * s, 0) / root[-1]
        white[done:], _ = lfilter(b, [1.0, -pole], y[done:], axis=0, zi=zi)
    return white


@lru_cache(maxsize=32)
def _settling(h: float, keep: float) -> tuple[Array, Array]:
    """Kalman gains and innovation variances, row by row until they settle, (n,) each."""
    P, before, rows = 1.0, np.inf, []
    while abs(P - before) >= SETTLED * P:
        S = h * P * h + 1.0
        gain = P * h / S
        rows.append((gain, S))
        before, P = P, keep * (P - gain * h * P) * keep + 1.0 - keep**2
    gains, variances = np.array(rows).T
    return frozen(gains), frozen(variances)


def periodogram(x: Array) -> Array:
    """Power of a stretch (n, ...) at the frequencies of `rfft`, (n // 2 + 1, ...)."""
    return np.asarray(np.abs(np.fft.rfft(x, axis=0)) ** 2 / max(len(x), 1))


def density(w: Array, ar: Array, left: float, slow: float, keep: float) -> Array:
    """Spectrum of noise at frequencies w (K,) [rad per sample], (K,) [A²].

    Args:
        left: innovation variance of its fast part.
        slow: variance of its slow part.
    """
    return _density(_turns(w, len(ar)) @ ar, left, slow * _passing(w, keep))


def _density(led: Complex, left: float, slow: Array) -> Array:
    """The same, (K,), of what earlier rows lead to [-], and of the slow part's spectrum [A²]."""
    return np.asarray(left / np.abs(1.0 - led) ** 2 + slow)


def _turns(w: Array, order: int) -> Complex:
    """Phases of the last `order` rows at each frequency, (K, order)."""
    return np.asarray(np.exp(-1j * np.outer(w, np.arange(1, order + 1))))


def _passing(w: Array, keep: float) -> Array:
    """Spectrum of slow noise of unit variance, (K,)."""
    return np.asarray((1.0 - keep**2) / np.abs(1.0 - keep * np.exp(-1j * w)) ** 2)


def share_of(w: Array, seen: Array, quick: Quick, keep: float) -> float:
    """Share of the variance that is slow, by the spectrum's likelihood. [Whittle1953]_

    It is the posterior mean over shares and regressions: a log has few independent values of slow
    noise, and the likeliest share is more often too small than too large. All orders are equally
    likely a priori; p coefficients cost p/2 log n for what they fit by chance [Schwarz1978]_. Else
    a long regression would absorb part of the slow noise, except its lowest frequencies, which
    disturb a fit most.

    Args:
        w: frequencies (K,) [rad per sample].
        seen: periodogram there, (K,) [A²].
    """
    w, seen, count = _averaged(w, seen)
    power = float(seen @ count / count.sum())
    price = 0.5 * float(np.log(2.0 * count.sum()))  # per coefficient
    regressions = [quick(share) for share in SHARES]
    order = max(len(ar) for each in regressions for ar, _ in each)
    turns, passing = _turns(w, order), _passing(w, keep)

    def misfit(share: float, ar: Array, left: float) -> float:
        foreseen = _density(turns[:, : len(ar)] @ ar, left, share * power * passing)
        return float(count @ (np.log(foreseen) + seen / foreseen)) + price * len(ar)

    pairs = zip(SHARES, regressions, strict=True)
    misfits = [np.array([misfit(share, *one) for one in each]) for share, each in pairs]
    least = min(float(each.min()) for each in misfits)
    weights = _before() * np.array([np.exp(least - each).sum() for each in misfits])
    return float(weights @ np.array(SHARES) / weights.sum())


def _before() -> Array:
    """Prior probabilities of SHARES."""
    likely = np.exp(-0.5 * (np.log(np.array(SHARES[1:]) / USUAL) / UNUSUAL) ** 2)
    return np.array([NONE, *(1.0 - NONE) * likely / likely.sum()])


def _averaged(w: Array, seen: Array) -> tuple[Array, Array, Array]:
    """Mean frequencies and powers in BINS, and the number of values in each."""
    at = np.digitize(w, np.geomspace(w.min(), np.pi, BINS))
    count = np.bincount(at).astype(float)
    some = count > 0.0
    means = [np.bincount(at, weights=x)[some] / count[some] for x in (w, seen)]
    return means[0], means[1], count[some]
