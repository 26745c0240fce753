"""A robot that begins anew while it is tracked, or whose clock is set: stamps are counted on.

Those of both of its lives are told apart, as `urdyn.io.clock` does for a recording.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from urdyn.io.clock import GAP, PAUSE, SET
from urdyn.signal import Sample
from urdyn.tracking.source import Arrival, Source, was_set

SAID = "its clock was set {} by {:.1f} s; stamps are counted on from {:.1f} s"


def arrivals(
    source: Source, first: int = 0, last: float = np.nan, ahead: float = 0.0
) -> Iterator[Arrival]:
    """The samples of a source from `first` on, stamps of a live one running on as time did.

    Where its clock was set they go on by the pause as it was on this computer's, and by PAUSE where
    nobody knows that. The source's `tell` hears of it, but for trifles.

    Args:
        last: the stamp before, counted on [s]; NaN before the first.
        ahead: by which that was ahead of the robot's own [s]; below 0 where it was set forwards.
    """
    return _counted_on(source, first, last, ahead) if source.live else source.start(first)


def _counted_on(source: Source, first: int, last: float, ahead: float) -> Iterator[Arrival]:
    received = np.nan
    for arrival in source.start(first):
        step = arrival.sample.t + ahead - last
        if was_set(step, received):
            waited = arrival.received - received
            # However short: what is estimated from both lives together would be neither's.
            pause = max(waited if np.isfinite(waited) else PAUSE, (GAP + 0.5) * source.period)
            ahead += pause - step
            if abs(step) > SET or np.isnan(waited):
                way, by = ("back", -step) if step < 0.0 else ("forwards", step - pause)
                source.tell(SAID.format(way, by, last + pause))
        sample = _later(arrival.sample, ahead) if ahead else arrival.sample
        last, received = sample.t, arrival.received
        yield replace(arrival, sample=sample, ahead=ahead)


def _later(sample: Sample, ahead: float) -> Sample:
    """The same, stamped later [s]; so is what it brings along."""
    beside = {
        name: np.column_stack([rows[:, 0] + ahead, rows[:, 1:]])
        for name, rows in sample.beside.items()
    }
    return replace(sample, t=sample.t + ahead, beside=beside)
