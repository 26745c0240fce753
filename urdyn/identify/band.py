"""The band in which a recording has power: what was filtered out of it carries no information.

Some recordings were low-passed before they were published. Above the cutoff their current lacks the
edges of friction that the model still has; and because next to no power is left there, a likelihood
with coloured noise would trust that band most of all. So both sides of the equation pass the same
linear filter, which keeps it true, and are decimated as far as the band allows. Unfiltered
recordings are left as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import butter, periodogram, sosfiltfilt

from urdyn.signal.stretches import median_step
from urdyn.types import Array, Mask, Motion

SILENT = 1e-3  # share of the current's size below which no sensor's noise is
CARRIED = 0.7  # of the kept samples' Nyquist frequency: highest cutoff
ENOUGH = 200  # samples to keep at least, to estimate the noise's colour
ORDER = 6


@dataclass(frozen=True)
class Band:
    """Low-pass filter and decimation."""

    every: int = 1  # decimation factor; 1: no filter
    edge: float = 1.0  # cutoff, as a share of the Nyquist frequency

    def __call__(self, x: Array) -> Array:
        """The rows of a run that are kept, (N, ...) -> (ceil(N / every), ...)."""
        if self.every == 1:
            return x
        low_pass = butter(ORDER, self.edge, output="sos")
        margin = min(len(x) - 1, 10 * self.every)
        smooth = sosfiltfilt(low_pass, x, axis=0, padlen=margin)
        return np.asarray(smooth[:: self.every])

    def rows(self, flags: Mask) -> Mask:
        """Flags of the rows that are kept."""
        return flags[:: self.every]


EVERYTHING = Band()


def common_band(motions: Sequence[Motion]) -> Band:
    """The band of the recording with the highest frequencies."""
    edge = max(_edge_of(motion) for motion in motions)
    rows = sum(len(motion) for motion in motions)
    every = min(int(CARRIED / edge), rows // ENOUGH)
    return Band(every, edge) if every > 1 else EVERYTHING


def low_passed(motion: Motion) -> bool:
    """Whether its currents lack so much of their upper band that half of the samples hold all."""
    return 2.0 * _edge_of(motion) <= CARRIED


def _edge_of(motion: Motion) -> float:
    """The highest frequency in a motion's currents, as a share of the Nyquist frequency."""
    edges = [0, *motion.breaks, len(motion)]
    start, stop = max(pairwise(edges), key=lambda run: run[1] - run[0])
    current = motion.current[start:stop]
    whole = current[:, np.isfinite(current).all(axis=0)]
    if not whole.size or not median_step(motion.t) > 0:
        return 1.0
    return max(_edge(column) for column in whole.T)


def _edge(x: Array) -> float:
    """Frequency above which next to no power is left, as a share of the Nyquist frequency."""
    frequency, power = periodogram(x, window="hann", detrend="linear")
    above = np.cumsum(power[::-1])[::-1]
    silent = above < SILENT**2 * above[0]
    return 2.0 * float(frequency[max(silent.argmax(), 1)]) if silent.any() else 1.0
