"""The best that can be reached: Page's test, knowing all of the ramp but its onset.

    W_t = max over onsets of  sum_k (m_k e_k - m_k^2 / 2),   m_k = rate * k

No detector that has to estimate the rate does better. For benchmarks: parallel runs, with a
threshold set by healthy runs.
"""

from __future__ import annotations

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_number, given_promise, given_rows
from urdyn.types import Array


def oracle_cusum(e: Array, rate: float) -> Array:
    """Log likelihood ratio of the known ramp, best onset, (N, runs).

    Args:
        e: innovations of independent runs, (N, runs) [sd], white and standard normal if healthy;
            NaN, where nothing was measured, adds nothing.
        rate: of the ramp [sd/step], signed.
    """
    rate = given_number(rate, "rate", "any number but 0", lambda x: x != 0.0)
    e = given_rows(e, "innovations")
    steps, runs = e.shape
    # Onsets are kept for six times the age at which such a ramp is found.
    known = max(1, min(steps, int(np.ceil(6.0 * (60.0 / rate**2) ** (1.0 / 3.0)))))
    m = rate * np.arange(1, known + 1.0)[:, None]
    gathered, best = np.full((known, runs), -np.inf), np.empty((steps, runs))
    for t in range(steps):
        gathered[1:] = gathered[:-1]
        gathered[0] = 0.0
        gathered += np.where(np.isnan(e[t]), 0.0, m * e[t] - 0.5 * m**2)
        best[t] = gathered.max(axis=0)
    return best


def calibrated(healthy: Array, promise: float) -> float:
    """Threshold that healthy statistics (N, runs) cross once in `promise` steps.

    Alarms come at a constant rate: a run of N steps crosses with probability 1 - exp(-N / promise).
    """
    promise, healthy = given_promise(promise), given_rows(healthy, "statistics")
    if not healthy.size or not np.isfinite(healthy).all():
        raise InputError("statistics of healthy runs are steps x runs of finite numbers")
    return float(np.quantile(healthy.max(axis=0), np.exp(-len(healthy) / promise)))
