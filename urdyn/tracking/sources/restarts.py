"""A robot that restarts while it is tracked, or whose clock is set: its stamps are continued.

A gap keeps both lives apart, as in a recording by `urdyn.io.clock`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from urdyn.io.clock import GAP, PAUSE, SET
from urdyn.signal import Sample
from urdyn.tracking.sources.source import Arrival, Source, was_set

SAID = "its clock was set {} by {:.1f} s; stamps are counted on from {:.1f} s"


def arrivals(
    source: Source, first: int = 0, last: float = np.nan, ahead: float = 0.0
) -> Iterator[Arrival]:
    """The samples of a source from `first` on; a live source's stamps run on as time does.

    Where its clock was set, they advance by the pause on this computer's clock, or by PAUSE where
    that is unknown. The source's `tell` reports it, except for trifles.

    Args:
        last: the previous stamp, as continued [s]; NaN before the first.
        ahead: how far that was ahead of the robot's own [s]; below 0 where it was set forwards.
    """
    return _counted_on(source, first, last, ahead) if source.live else source.start(first)


def _counted_on(source: Source, first: int, last: float, ahead: float) -> Iterator[Arrival]:
    received = np.nan
    for arrival in source.start(first):
        step = arrival.sample.t + ahead - last
        if was_set(step, received):
            waited = arrival.received - received
            # A gap, however short the pause: motion estimated across a restart would be wrong.
            pause = max(waited if np.isfinite(waited) else PAUSE, (GAP + 0.5) * source.period)
            ahead += pause - step
            if abs(step) > SET or np.isnan(waited):
                way, by = ("back", -step) if step < 0.0 else ("forwards", step - pause)
                source.tell(SAID.format(way, by, last + pause))
        sample = _later(arrival.sample, ahead) if ahead else arrival.sample
        last, received = sample.t, arrival.received
        yield replace(arrival, sample=sample, ahead=ahead)


def _later(sample: Sample, ahead: float) -> Sample:
    """The same, stamped later [s], with its streams' rows."""
    beside = {
        name: np.column_stack([rows[:, 0] + ahead, rows[:, 1:]])
        for name, rows in sample.beside.items()
    }
    return replace(sample, t=sample.t + ahead, beside=beside)
