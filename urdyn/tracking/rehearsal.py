"""A rehearsal before the first sample, so that a live robot does not wait for caches to fill."""

from __future__ import annotations

from typing import Any

import numpy as np

from urdyn.estimate import Filter
from urdyn.identify.fit import Fit
from urdyn.signal import Sample
from urdyn.tracking.belief.physical import quantities
from urdyn.tracking.output.history_row import row
from urdyn.tracking.step.tracker import Tracker

PERIOD = 0.002  # [s]
SAMPLES = 40  # more than any signal window


def rehearse(fit: Fit, filter_: Filter[Any]) -> None:
    """Do once what is slow the first time: load modules, fill tables."""
    J = fit.dynamics.arm.joints
    tracker: Tracker[Any] = Tracker(fit, filter_, PERIOD)
    of = quantities(fit, tracker.currents)
    state, nothing = tracker.init(), np.full(J, np.nan)
    for k in range(SAMPLES):
        t = k * PERIOD
        now = Sample(t, np.full(J, np.sin(t)), np.full(J, np.cos(t)), np.zeros(J), nothing)
        state, reading = tracker.step(state, now)
        if reading is not None:
            row(reading, *of.of(reading.belief, reading.beside))
