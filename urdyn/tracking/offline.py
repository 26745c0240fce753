"""Tracking of a whole recording: the steps of a live run, with nothing written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from urdyn.errors import LogError
from urdyn.estimate import UKF, Filter, Track
from urdyn.identify.fit import Fit, fit_in
from urdyn.model.whose import require_own
from urdyn.signal import require_measured, samples
from urdyn.signal.channels import has_velocities
from urdyn.signal.stretches import median_step
from urdyn.tracking.belief.interest import Interest, after, as_plain, nothing_yet
from urdyn.tracking.belief.payload_setting import Setting, agrees, at_the_end
from urdyn.tracking.belief.physical import quantities, weighed
from urdyn.tracking.belief.spare_payload import rest_of
from urdyn.tracking.output.history_row import spacing
from urdyn.tracking.sources.source import Arrival, Source
from urdyn.tracking.step.tracker import Tracker
from urdyn.twin import Twin
from urdyn.types import Log


@dataclass(frozen=True, eq=False)
class Tracked(Track):
    """The history of an arm's quantities, with the tracker and the log that gave it."""

    tracker: Tracker[Any]
    log: Log
    shown: Interest  # margins, energy and predictive error over the run
    setting: Setting  # the controller's payload setting at the end
    payload_known: bool  # the motion has told what is carried
    restarts: int  # resets of the belief to the commissioned arm, as it was not credible

    @property
    def quantities(self) -> dict[str, Any]:
        """Margins, power and predictive error, joint by joint, as `urdyn track --json` has them."""
        arm = self.tracker.fit.dynamics.arm
        rest = rest_of(arm, self._load, self.payload_known)
        return as_plain(self.shown, arm.joint_names, rest)

    @property
    def payload_setting(self) -> dict[str, Any] | None:
        """The controller's payload beside the load at the end, as in `urdyn track --json`."""
        whole = self.tracker.fit.tool_known
        return at_the_end(self.setting, self._load, whole, self.payload_known)

    @property
    def load_as_set(self) -> bool:
        """Whether the controller is set to the load at the end."""
        return agrees(self.setting, self._load)

    @property
    def _load(self) -> Mapping[str, Any]:
        """The load at the end, as in a summary."""
        k = self.names.index("payload.mass")
        return {"payload.mass": {"mean": float(self.mean[-1, k]), "sd": float(self.sd[-1, k])}}


def track(
    twin: Twin | Fit,
    log: Log,
    filter: Filter[Any] | None = None,
) -> Tracked:
    """The history of an arm's quantities while `log` was recorded.

    went = urdyn.track(twin, urdyn.read("monday.parquet"))
    went["elbow_joint.coulomb"], went.sd[-1]  # N·m over time; of all quantities at the end
    went.quantities["payload_margin_kg"]  # what it could have carried besides

    At most ten instants a second. Names and units are those of `history.parquet`, which `urdyn
    track` writes from the same steps. `urdyn.diagnose` turns the result into findings.

    Args:
        filter: None is the unscented Kalman filter, as on the command line.

    Raises:
        LogError: it is of an arm with other joints, its currents are not in amperes, or it is too
            short.
    """
    tracker = tracker_of(twin, log, filter)
    of, every = quantities(tracker.fit, tracker.currents), spacing(tracker.period)
    state, first = tracker.init(), tracker.model.prior.mean
    load = of.names.index("payload.mass")
    shown = nothing_yet(tracker.currents.reference.arm.joints)
    setting = Setting(tool=float(tracker.fit.dynamics.payload[0]))
    t, means, sds, surprises = [], [], [], []
    with threadpool_limits(1):  # the matrices are small: threads would wait for one another
        for k, sample in enumerate(samples(log), 1):
            moved, (state, reading) = state.moved, tracker.step(state, sample)
            setting = setting.heard(sample.setting, state.moved - moved)
            if reading is None:
                continue
            shown = after(shown, reading, of, first, k % every == every // 2)
            if k % every == 0 or reading.widened:
                mean, sd = of.of(reading.belief, reading.beside)
                known = weighed(reading.belief, tracker.currents)
                known = known and not state.rest.just(reading.t)
                now = float(mean[load]), float(sd[load])
                setting = setting.beside(*now, known, reading.unknown)
                t.append(reading.t)
                means.append(mean)
                sds.append(sd)
                surprises.append(reading.innovation)
            last = reading
    if not t:
        raise LogError("too short, or too full of gaps, to be tracked", log.source.path)
    return Tracked(
        names=of.names,
        t=np.array(t),
        mean=np.array(means),
        sd=np.array(sds),
        innovations=tuple(surprises),
        tracker=tracker,
        log=log,
        shown=shown,
        setting=setting,
        payload_known=weighed(last.belief, tracker.currents),
        restarts=state.restarts,
    )


def tracker_of(
    twin: Twin | Fit,
    log: Log,
    filter: Filter[Any] | None = None,
) -> Tracker[Any]:
    """The tracker for `log`; LogError where it is not a log of that arm."""
    fit = fit_in(twin)
    require_measured(log)
    if why := fit.dynamics.unlike(log.joint("actual_current")):
        raise LogError(why, log.source.path)
    require_own(fit.dynamics.arm, log)
    period = median_step(log.t)
    if not period > 0.0:
        raise LogError("has one row only; nothing can be tracked", log.source.path)
    return Tracker(fit, filter or UKF(), period, velocities=has_velocities(log))


def replayed(log: Log, period: float) -> Source:
    """The log as a stream of samples."""
    return Source(
        name=log.source.path,
        identity=f"{log.source.sha256} {log.source.rows}",
        sha256=log.source.sha256,
        period=period,
        joints=log.joints,
        live=False,
        length=len(log),
        start=lambda first: map(Arrival, samples(log.slice(first))),
        close=lambda: None,
        defects=tuple(map(str, log.defects)),
        velocities=has_velocities(log),
    )
