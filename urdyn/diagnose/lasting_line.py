"""Whether a line of a spectrum is one that rings: it stands out, alone, and lasts.

An amplitude's course is told in quarters of a window. What a brake or a passing motion makes fades,
begins late or loses its phase.
"""

from __future__ import annotations

import numpy as np

from urdyn.types import Array

# Other lines, [-] times their neighbours: a motion repeats itself, no loop rings. Of more bins than
# these more are that loud by chance, as many as of so few that are louder by this power of them.
CROWD, BINS, BY_CHANCE = (3, 7.0), 50, 0.3
STAYS = 0.5  # [-] of its largest amplitude that a line has at least in each quarter
RISES = 0.2  # [-] of its last amplitude that one that grows has at first
FADED = 0.85  # [-] of its amplitude that a line has to keep
COHERENT = 0.8  # [-] of its amplitude that is left over the whole: it keeps its phase


def peaks(ratio: Array, threshold: float) -> list[int]:
    """Bins (F,) that stand out of those beside them and so far, the clearest first.

    The clearest may be a gear's, or what a brake makes: another beside it may last.
    """
    before, after = np.pad(ratio, (1, 0))[:-1], np.pad(ratio, (0, 1))[1:]
    there = np.flatnonzero((ratio >= before) & (ratio > after) & (ratio >= threshold))
    clearest = there[np.argsort(-ratio[there])]
    return [int(at) for at in clearest[: CROWD[0]]]


def others(ratio: Array, at: float) -> int:
    """Lines (F,) that stand out beside the one at this bin, and are none of its multiples."""
    inner = ratio[1:-1]
    loud = CROWD[1] * (len(ratio) / BINS) ** BY_CHANCE
    peak = (inner > loud) & (inner >= ratio[:-2]) & (inner > ratio[2:])
    there = np.flatnonzero(peak) + 1
    multiple = np.maximum(np.rint(there / at), 1.0)
    return int(np.count_nonzero(np.abs(there - multiple * at) > multiple + 1.0))


def lasts(sizes: Array, whole: float, noise: float) -> bool:
    """A line that neither fades nor was only passing, and keeps its phase.

    Args:
        noise: sd of an amplitude by quarter; that of the whole is half of it.
    """
    there = sizes.min() > STAYS * sizes.max() - noise or bool((np.diff(sizes) > 0.0).all())
    first, last = sizes[:2].mean(), sizes[2:].mean()
    kept = last > FADED * first - noise and whole > COHERENT * sizes.mean() - 0.5 * noise
    return bool(there and kept and _began(sizes))


def _began(sizes: Array) -> bool:
    """Whether a line is there from the first quarter on: a brake that begins later makes one."""
    return bool(sizes[0] > RISES * sizes[-1])
