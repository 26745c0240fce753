"""The default way from Log to Motion: nothing that the likelihood will see is filtered."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import LogError
from urdyn.given import given_count, given_log
from urdyn.signal.channels import POSSIBLE, has_velocities
from urdyn.signal.kinematics import kinematics
from urdyn.signal.measured import measured
from urdyn.signal.misplaced import misplaced
from urdyn.signal.polynomial import LocalPolynomial, half_window, instrument_half
from urdyn.signal.shifts import SHAKEN, jumps, without_turns
from urdyn.signal.stretches import breaks, median_step
from urdyn.signal.units import complaint, unfilled, wrong_unit
from urdyn.types import JOINT_SERIES, Array, Log, Mask, Motion, frozen

FAR = 4.0 * np.pi  # [rad] twice what a UR's joint turns either way
CHUNK = 65536  # rows that are processed at a time: their working memory is small beside a log


class Jointed(Protocol):
    """What has joints: an arm."""

    @property
    def joints(self) -> int:
        """How many."""


def condition(
    log: Log,
    arm: Jointed | None = None,
    *,
    offset: ArrayLike = 0.0,
    half_window: int | None = None,
    degree: int = 4,
) -> Motion:
    """Motion at the stamps of `log`: current and stamps as measured, kinematics estimated there.

    `arm`: whose log it has to be; None: not checked.

    `offset` [s], () or (J,): by how much the current leads the joint's own stream; the kinematics
    are those of t + offset. `half_window` [samples] to each side, at most as many as the log has;
    None: by the sample rate. A gap, a step of more than 5 median steps, begins a new stretch.
    Missing currents stay NaN: smoothing or filling them in would colour the noise, and every
    interval downstream would be too narrow.

    Raises:
        LogError: it has no stretch of motion that can be conditioned, or is no log of `arm`.
        InputError: such a window does not determine a polynomial of the degree, or there is none.
    """
    log = given_log(log)
    if arm is not None and log.joints != arm.joints:
        raise LogError(f"has {log.joints} joints, the arm {arm.joints}", log.source.path)
    return conditioned(measured(log), offset, half_window, degree)


def conditioned(
    log: Log, offset: ArrayLike = 0.0, half_window: int | None = None, degree: int = 4
) -> Motion:
    """`condition` of a log as far as its sensors have `measured` it."""
    settled = _settle(log, offset, half_window, degree)
    shape = len(log), log.joints
    series = {name: np.empty(shape) for name in JOINT_SERIES}
    for rows, chunk in settled.chunks(log, CHUNK):
        for name, values in series.items():
            values[rows] = getattr(chunk, name)
    made = {name: frozen(values) for name, values in series.items()}  # not copied
    return Motion(log.t, **made, breaks=breaks(log.t, settled.fit.step), source=log.source)


def stream(
    log: Log,
    rows: int = CHUNK,
    *,
    offset: ArrayLike = 0.0,
    half_window: int | None = None,
    degree: int = 4,
) -> Iterator[Motion]:
    """The motion of `condition`, `rows` at a time: joined end to end they are the same numbers.

    A break on the first row of a chunk is the jump of time between the chunks: `Motion.breaks`
    does not name row 0.
    """
    rows = given_count(rows, "rows")
    log = measured(given_log(log))
    for part, chunk in _settle(log, offset, half_window, degree).chunks(log, rows):
        yield replace(chunk, source=log.slice(part.start, part.stop).source)


@dataclass(frozen=True, eq=False)
class _Settled:
    """What has to be known of the whole log before any part of it can be conditioned."""

    fit: LocalPolynomial
    offset: ArrayLike  # [s]

    def chunks(self, log: Log, rows: int) -> Iterator[tuple[slice, Motion]]:
        """The motion of a whole log, so many rows at a time, and which rows they are."""
        # A shifted window ends this far from its row, and a jump shakes rows as far behind it.
        fit = self.fit
        halo = 2 * instrument_half(fit.half, fit.degree, fit.step) + round(SHAKEN / fit.step)
        for start in range(0, len(log), rows):
            stop, lo = min(start + rows, len(log)), max(0, start - halo)
            chunk = self.motion(log.slice(lo, stop + halo))
            yield slice(start, stop), chunk.slice(start - lo, stop - lo)

    def motion(self, log: Log) -> Motion:
        """Motion of `log`, which is the whole or a part."""
        q, v = (_measured(log, name) for name in ("actual_q", "actual_qd"))
        fit = self.fit
        shift, misled = jumps(log.t, q, v, fit.half)
        shifted = np.cumsum(shift, axis=0)  # not a motion of the joint
        shift[-1] = 0.0  # no later row confirms that one
        how = partial(kinematics, offset=self.offset, degree=fit.degree, step=fit.step)
        moved = how(log.t, q - shifted, np.where(misled, np.nan, v), half=fit.half)
        half, gaps = instrument_half(fit.half, fit.degree, fit.step), breaks(log.t, fit.step)
        known = np.asarray(np.isfinite(q).all(axis=1))
        told = _known_around(known, gaps, 2 * half - fit.half, fit.half)[:, None]
        alone = how(log.t, q - shifted, half=half, ahead=fit.half).a
        temperature = log.joint("joint_temperatures")
        return Motion(  # of frozen arrays, which it does not copy
            t=log.t,
            q=frozen(moved.q + shifted),
            v=frozen(moved.v),
            a=frozen(moved.a),
            jerk=frozen(moved.jerk),
            current=log.joint("actual_current"),
            temperature=frozen(np.where(np.abs(temperature) < POSSIBLE[-1], temperature, np.nan)),
            breaks=gaps,
            source=log.source,
            shift=frozen(without_turns(shift)),
            instrument=frozen(np.where(told, alone, np.nan)),
        )


def _known_around(known: Mask, gaps: tuple[int, ...], back: int, ahead: int) -> Mask:
    """Rows with `back` known ones before them and `ahead` after them, without a gap; (N,)."""
    after_gap = np.zeros(len(known), dtype=bool)
    after_gap[list(gaps)] = True
    unknown, broken = (np.concatenate([[0], np.cumsum(of)]) for of in (~known, after_gap))
    row = np.arange(back, max(len(known) - ahead, back))
    first, last = row - back, row + ahead + 1
    whole = np.zeros(len(known), dtype=bool)
    whole[row] = (unknown[last] == unknown[first]) & (broken[last] == broken[first + 1])
    return whole


def _measured(log: Log, name: str) -> Array:
    """Per-joint channel in which an infinity counts as not measured."""
    values = log.joint(name)
    return np.where(np.isfinite(values), values, np.nan)


def require_measured(log: Log, names: Collection[str] = ("actual_q", "actual_current")) -> None:
    """LogError unless these channels, and every joint's angle, were measured, in SI units."""
    log = given_log(log)
    if fault := next(_faults(log, names), None):
        message, column = fault
        raise LogError(message, log.source.path, column=column)


def _faults(log: Log, names: Collection[str]) -> Iterator[tuple[str, str]]:
    """What no motion can be made of: a sentence each, and the column to blame."""
    for name in names:
        if not np.isfinite(log.joint(name)).any():
            there = ", ".join(sorted(log.channels)) or "no channel at all"
            what = "no finite value" if name in log else "no channel"
            yield f"{what} {name}; there is {there}: name the columns or record it", name
    for j in np.flatnonzero(~np.isfinite(log.joint("actual_q")).any(axis=0)):
        told = f"no finite value of joint {j} in actual_q: name its column or record it"
        yield told, f"actual_q_{j}"
    if median_step(log.t) == 0.0:
        yield "most of its rows have the stamp of the row before; keep one row a stamp", "timestamp"
    far = np.nanmedian(np.abs(_measured(log, "actual_q")), axis=0) > FAR
    if np.count_nonzero(far) > 1:  # a last joint may turn without end
        which = ", ".join(map(str, np.flatnonzero(far)))
        told = f"joints {which} are beyond two turns; angles are to be in rad: is it degrees?"
        yield told, "actual_q"
    if unfilled(log):
        yield "its velocities are all zero, and its angles change; leave them out", "actual_qd"
    if unit := wrong_unit(log):
        yield complaint(unit)
    if message := misplaced(log):
        yield message, "actual_qd"


def _settle(log: Log, offset: ArrayLike, half: int | None, degree: int) -> _Settled:
    """Refuse a log that no motion can be made of, and fix what depends on all of its rows."""
    require_measured(log)
    step = median_step(log.t)
    if len(log) < 2:
        raise LogError("one row only; a motion needs at least two", log.source.path)
    usual = half_window(step, degree, has_velocities(log))
    half = usual if half is None else given_count(half, "half_window", 1, len(log))
    return _Settled(LocalPolynomial(half, degree, step), offset)
