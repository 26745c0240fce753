"""Whether a spectral line is a loop that rings: it stands out, alone, and lasts.

The amplitude's course is judged in quarters of a window. A line from a brake or a passing motion
fades, begins late or loses its phase.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

# So many other lines, so many times [-] their neighbours, show a motion that repeats, no ringing
# loop. The factor is for so many bins, and rises with their number by this power, as chance has it.
CROWD, BINS, BY_CHANCE = (3, 7.0), 50, 0.3
STAYS = 0.5  # [-] of its largest amplitude that a line must have in each quarter
RISES = 0.2  # [-] of its last amplitude that a growing line has at first
FADED = 0.85  # [-] of its amplitude that a line has to keep
COHERENT = 0.8  # [-] of its amplitude left in the whole window: it keeps its phase


def peaks(ratio: Array, threshold: float) -> list[int]:
    """Bins of (F,) that exceed their neighbours and the threshold, the clearest first.

    The clearest may come from a gear or a brake, while another lasts.
    """
    before, after = np.append(0.0, ratio[:-1]), np.append(ratio[1:], 0.0)
    there = np.flatnonzero((ratio >= before) & (ratio > after) & (ratio >= threshold))
    clearest = there[np.argsort(-ratio[there])]
    return [int(at) for at in clearest[: CROWD[0]]]


def others(ratio: Array, at: float) -> int:
    """Number of lines of (F,) that stand out, apart from the one at this bin and its multiples."""
    inner = ratio[1:-1]
    loud = CROWD[1] * (len(ratio) / BINS) ** BY_CHANCE
    peak = (inner > loud) & (inner >= ratio[:-2]) & (inner > ratio[2:])
    there = np.flatnonzero(peak) + 1
    multiple = np.maximum(np.rint(there / at), 1.0)
    return int(np.count_nonzero(np.abs(there - multiple * at) > multiple + 1.0))


def lasts(sizes: Array, whole: float, noise: float) -> bool:
    """Whether a line neither fades nor was only passing, and keeps its phase.

    Args:
        noise: sd of an amplitude by quarter; that of the whole is half of it.
    """
    there = sizes.min() > STAYS * sizes.max() - noise or bool((np.diff(sizes) > 0.0).all())
    first, last = sizes[:2].mean(), sizes[2:].mean()
    kept = last > FADED * first - noise and whole > COHERENT * sizes.mean() - 0.5 * noise
    return bool(there and kept and _began(sizes))


def _began(sizes: Array) -> bool:
    """Whether a line exists from the first quarter on: a brake's may begin later."""
    return bool(sizes[0] > RISES * sizes[-1])
