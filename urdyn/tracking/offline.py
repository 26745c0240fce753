"""A recording tracked at once: the steps that are taken beside a robot, and nothing written."""

from __future__ import annotations

from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from urdyn.errors import LogError
from urdyn.estimate import UKF, Filter, Track
from urdyn.identify.fit import Fit
from urdyn.signal import require_measured, samples
from urdyn.signal.stretches import median_step
from urdyn.tracking.physical import quantities
from urdyn.tracking.row import spacing
from urdyn.tracking.tracker import Tracker
from urdyn.types import Log


def track(
    fit: Fit,
    log: Log,
    filter: Filter[Any] | None = None,  # noqa: A002 - the domain's word
) -> Track:
    """Where the quantities of an arm went while `log` was recorded.

    went = urdyn.track(twin.fit, urdyn.read("monday.parquet"))
    went["elbow_joint.coulomb"], went.sd[-1]  # N·m over time; of all quantities at the end

    Ten instants a second at most. Names and units are those of `history.parquet`, which `urdyn
    track` writes from the same steps.

    Args:
        filter: None is the unscented Kalman filter, as on the command line.

    Raises:
        LogError: it is of an arm with other joints, its currents are not in amperes, or it is too
            short.
    """
    require_measured(log, ("actual_q", "actual_current"))
    if why := fit.dynamics.unlike(log.joint("actual_current")):
        raise LogError(why, log.source.path)
    period = median_step(log.t)
    if not period > 0.0:
        raise LogError("has one row only; nothing can be tracked", log.source.path)
    tracker: Tracker[Any] = Tracker(fit, filter or UKF(), period)
    of, state, every = quantities(fit, tracker.currents), tracker.init(), spacing(period)
    t, means, sds, surprises = [], [], [], []
    with threadpool_limits(1):  # the matrices are small: threads would wait for one another
        for k, sample in enumerate(samples(log), 1):
            state, reading = tracker.step(state, sample)
            if reading is not None and (k % every == 0 or reading.widened):
                mean, sd = of.of(reading.belief, reading.beside)
                t.append(reading.t)
                means.append(mean)
                sds.append(sd)
                surprises.append(reading.innovation)
    if not t:
        raise LogError("too short, or too full of gaps, to be tracked", log.source.path)
    return Track(of.names, np.array(t), np.array(means), np.array(sds), tuple(surprises))
