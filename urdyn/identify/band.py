"""The band in which a recording has power: what was filtered out of it carries no information.

Some recordings were low-passed before they were published. Above the cut their current tells no
more of friction's edges, while the model still has them; and because next to nothing is left there,
a likelihood with coloured noise would trust that nothing most of all. So both sides of the equation
pass the same filter, which is linear and therefore keeps it true, and as many samples are kept as
such a band can carry. Recordings that were not filtered are left as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import butter, periodogram, sosfiltfilt

from urdyn.signal.stretches import median_step
from urdyn.types import Array, Mask, Motion

SILENT = 1e-3  # share of the current's size that no sensor's noise stays below
CARRIED = 0.7  # of half the rate of the kept samples: there the filter cuts, or lower
ENOUGH = 200  # samples that are kept at least, for the colour of the noise to be told from them
ORDER = 6


@dataclass(frozen=True)
class Band:
    """Every so many-th sample of what lies below a frequency that those can carry."""

    every: int = 1  # 1: all there is
    edge: float = 1.0  # what is kept lies below this share of half the sample rate

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
    """The band of the recording that has most to say."""
    edge = max(_edge_of(motion) for motion in motions)
    rows = sum(len(motion) for motion in motions)
    every = min(int(CARRIED / edge), rows // ENOUGH)
    return Band(every, edge) if every > 1 else EVERYTHING


def _edge_of(motion: Motion) -> float:
    """The largest frequency that a motion's currents hold."""
    edges = [0, *motion.breaks, len(motion)]
    start, stop = max(pairwise(edges), key=lambda run: run[1] - run[0])
    current = motion.current[start:stop]
    whole = current[:, np.isfinite(current).all(axis=0)]
    if not whole.size or not median_step(motion.t) > 0:
        return 1.0
    return max(_edge(column) for column in whole.T)


def _edge(x: Array) -> float:
    """Frequency above which next to nothing is left, as a share of half the sample rate."""
    frequency, power = periodogram(x, window="hann", detrend="linear")
    above = np.cumsum(power[::-1])[::-1]
    silent = above < SILENT**2 * above[0]
    return 2.0 * float(frequency[max(silent.argmax(), 1)]) if silent.any() else 1.0
