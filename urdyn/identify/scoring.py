"""How well a model predicts a log to which it was not fitted.

The current of a joint at rest is set by stiction, anywhere up to Coulomb friction to either side,
and no model can predict it. Such rows count in relative errors, which cover all measurements, as
others publish them; the model's own intervals are judged by rows in which the joint moves. Rows
after a gap are treated likewise, until the joint has moved far enough to forget its start.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt
from scipy.stats import t as student

from urdyn.errors import LogError
from urdyn.given import given_log
from urdyn.identify.band import low_passed
from urdyn.identify.design import SETTLED
from urdyn.identify.enough import dead, too_few
from urdyn.identify.fit import Fit, Fitted, fit_in
from urdyn.identify.unsure import unsure
from urdyn.model.dynamics import Dynamics
from urdyn.model.population import KAPPA, KAPPA_SD
from urdyn.model.whose import require_own
from urdyn.signal import conditioned, measured
from urdyn.signal.stretches import median_step, stretches
from urdyn.types import STANDSTILL, Array, Defect, Log, Mask, Motion

FLOOR_BAND = 10.0  # [Hz] above which residuals are mostly sensor noise


@dataclass(frozen=True, eq=False)
class Score:
    """Prediction of one log's raw current, joint by joint; NaN where there is no current."""

    log: Log
    predicted: Array  # (N, J) [A], from positions and velocities alone
    rre_percent: Array  # (J,) 100 |i - i_predicted| / |i|
    rmse: Array  # (J,) [A]
    target_rre_percent: Array  # (J,) the same for the controller's own target_current
    # (J,) share of the measured current above FLOOR_BAND; NaN where low_passed, or sampled slowly.
    floor_percent: Array
    low_passed: bool  # the current, before it was recorded
    half: Array  # (N, J) [A] half width of the 90 % interval of a sample
    moves: Mask  # (N, J) rows with a current in which the joint moves and its friction is known
    standing: Array  # (J,) share of the rows with a current in which it stands [-]
    moving_rre_percent: Array  # (J,) rre_percent of the rows in `moves`
    coverage90: Array  # (J,) share of those inside the predicted 90 % interval [-]

    @property
    def duration(self) -> float:
        """Time from the first row to the last [s]."""
        return float(self.log.t[-1] - self.log.t[0])


def validate(twin: Fit | Fitted, log: Log) -> Score:
    """Score of a twin on a log, on the raw current, where a motor can draw it.

    Raises:
        LogError: it is of another arm, its currents are not in amperes, or they are too few.
    """
    fit, log = fit_in(twin), given_log(log)
    if why := fit.dynamics.unlike(log.joint("actual_current")):
        raise LogError(why, log.source.path)
    require_own(fit.dynamics.arm, log)
    log = _drawn(fit.dynamics, measured(log))
    motion = conditioned(log)
    if why := too_few(motion.current):
        raise LogError(why, log.source.path)
    predicted = fit.dynamics.current(motion) + _warmth(fit.dynamics, motion)
    error = motion.current - predicted
    target_error = motion.current - log.joint("target_current")
    filtered = low_passed(motion)
    floor = np.nan if filtered else noise_floor(log.t, motion.current)
    told = np.isfinite(error)
    slides = told & (np.abs(motion.v) > STANDSTILL)
    moves = slides & _known(fit.dynamics, motion)
    moving_error, half = np.where(moves, error, np.nan), interval(fit, motion)
    return Score(
        log=log,
        predicted=predicted,
        rre_percent=_percent(error, motion.current),
        rmse=_rms(error),
        target_rre_percent=_percent(target_error, motion.current),
        floor_percent=_percent_of(floor, _rms(motion.current)),
        low_passed=filtered,
        half=half,
        moves=moves,
        standing=1.0 - _share(slides, told),
        moving_rre_percent=_percent(moving_error, motion.current),
        coverage90=_share(np.abs(moving_error) <= half, moves),
    )


def _known(dynamics: Dynamics, motion: Motion) -> Mask:
    """Where friction does not depend on a joint's motion during a gap, (N, J)."""
    known = np.ones(motion.q.shape, dtype=bool)  # a log usually begins at rest
    if motion.breaks:
        after = slice(motion.breaks[0], None)
        travelled = dynamics.bristles(motion).travelled[after]
        known[after] = travelled > SETTLED * dynamics.drive.presliding_distance
    return known


def amiss_in(dynamics: Dynamics, q: Array, current: Array) -> tuple[Defect, ...]:
    """Defects of currents (N, J) [A] at angles q [rad]; empty where there are none."""
    return _amiss(_none(dynamics, q, current))


def _amiss(none: dict[str, Mask]) -> tuple[Defect, ...]:
    return tuple(Defect(what, int(n), 0, "left out") for what, m in none.items() if (n := m.sum()))


def _none(dynamics: Dynamics, q: Array, current: Array) -> dict[str, Mask]:
    """Which currents (N, J) [A] are invalid, by kind of defect."""
    return {
        "current that no motor draws": dynamics.undrawn(current),
        "current that never changes while its joint moves": np.isfinite(current) & dead(q, current),
    }


def _drawn(dynamics: Dynamics, log: Log) -> Log:
    """A log without invalid currents."""
    current = log.joint("actual_current")
    none = _none(dynamics, log.joint("actual_q"), current)
    if not (amiss := _amiss(none)):
        return log
    measured = np.where(np.any([*none.values()], axis=0), np.nan, current)
    channels = {**log.channels, "actual_current": measured}
    return replace(log, channels=channels, defects=(*log.defects, *amiss))


def noise_floor(t: Array, current: Array) -> Array:
    """RMS of the current above FLOOR_BAND, (J,) [A]; NaN below 2.5 samples per period of that.

    No smooth model of the motion can predict it. It is taken over each joint's stretches between
    gaps; NaN also where none is long enough.
    """
    rate, quick = 1.0 / median_step(t), np.full_like(current, np.nan)
    if rate < 2.5 * FLOOR_BAND:
        return _rms(quick)
    low_pass = butter(4, FLOOR_BAND, fs=rate, output="sos")
    for x, out in zip(current.T, quick.T, strict=True):
        known = np.flatnonzero(np.isfinite(x))
        for rows in (known[stretch] for stretch in stretches(t[known])):
            if len(rows) >= 4 * rate / FLOOR_BAND + 30:
                out[rows] = x[rows] - sosfiltfilt(low_pass, x[rows])
    return _rms(quick)


def interval(fit: Fit, motion: Motion) -> Array:
    """Half width of the 90 % interval of a sample of current, (N, J) [A].

    Of its noise, and of what is unknown of the parameters and of the effect of warmth.
    """
    dof = fit.noise.dof
    quantile = student.ppf(0.95, dof) * np.sqrt((dof - 2.0) / dof)
    warmth = KAPPA_SD / KAPPA * _warmth(fit.dynamics, motion)
    return np.asarray(quantile * np.hypot(fit.noise.sd, np.hypot(unsure(fit, motion), warmth)))


def _warmth(dynamics: Dynamics, motion: Motion) -> Array:
    """Current by the usual effect of warmth, (N, J) [A]; 0 where the model has the joint's own."""
    drive = dynamics.drive
    warmer = np.nan_to_num(motion.temperature - drive.temperature)
    saved = np.where(drive.thermal == 0.0, KAPPA * drive.viscous * warmer * motion.v, 0.0)
    return np.asarray(-saved / (drive.gain * drive.health))


def _share(part: Mask, whole: Mask) -> Array:
    """Share of rows, (J,) [-]; NaN where there are none."""
    rows = whole.sum(axis=0)
    return np.asarray(part.sum(axis=0) / np.where(rows > 0, rows, np.nan))


def _percent(error: Array, current: Array) -> Array:
    """Norm of an error over that of the current in the same rows, (J,) [%]."""
    return _percent_of(_norm(error), _norm(np.where(np.isfinite(error), current, np.nan)))


def _percent_of(part: Array | float, whole: Array) -> Array:
    """Percentage; NaN where the whole is 0."""
    return np.asarray(100.0 * part / np.where(whole > 0.0, whole, np.nan))


def _norm(x: Array) -> Array:
    """Euclidean norm over the finite rows; NaN where there are none."""
    measured = np.isfinite(x)
    total = np.sqrt(np.sum(np.where(measured, x, 0.0) ** 2, axis=0))
    return np.where(measured.any(axis=0), total, np.nan)


def _rms(x: Array) -> Array:
    return np.asarray(_norm(x) / np.sqrt(np.maximum(np.isfinite(x).sum(axis=0), 1)))
