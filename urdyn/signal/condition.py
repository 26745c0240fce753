"""The default way from Log to Motion: nothing that the likelihood will see is filtered."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import LogError
from urdyn.signal.kinematics import kinematics
from urdyn.signal.polynomial import half_window
from urdyn.signal.shifts import shifts, without_turns
from urdyn.signal.stretches import breaks, median_step
from urdyn.types import Array, Log, Motion


def condition(
    log: Log, *, offset: ArrayLike = 0.0, half_window: int | None = None, degree: int = 4
) -> Motion:
    """Motion at the stamps of `log`: current and stamps as measured, kinematics estimated there.

    `offset` [s], () or (J,): by how much the current leads the joint's own stream; the kinematics
    are those of t + offset. `half_window` [samples] to each side; None: by the sample rate. A gap,
    a step of more than 5 median steps, begins a new stretch. Missing currents stay NaN: smoothing
    or filling them in would colour the noise, and every interval downstream would be too narrow.
    """
    return _settle(log, offset, half_window, degree).motion(log)


def stream(
    log: Log,
    rows: int = 65536,
    *,
    offset: ArrayLike = 0.0,
    half_window: int | None = None,
    degree: int = 4,
) -> Iterator[Motion]:
    """The motion of `condition`, `rows` at a time: joined end to end they are the same numbers.

    A break on the first row of a chunk is the jump of time between the chunks: `Motion.breaks`
    does not name row 0.
    """
    settled = _settle(log, offset, half_window, degree)
    halo = 2 * settled.half  # a shifted window ends this far from its row
    for start in range(0, len(log), rows):
        stop = min(start + rows, len(log))
        lo = max(0, start - halo)
        chunk = settled.motion(log.slice(lo, stop + halo)).slice(start - lo, stop - lo)
        yield replace(chunk, source=log.slice(start, stop).source)


@dataclass(frozen=True)
class _Settled:
    """What has to be known of the whole log before any part of it can be conditioned."""

    step: float  # [s]
    half: int  # [samples]
    degree: int
    offset: ArrayLike  # [s]

    def motion(self, log: Log) -> Motion:
        """Motion of `log`, which is the whole or a part."""
        q, v = (_measured(log, name) for name in ("actual_q", "actual_qd"))
        shift = shifts(log.t, q, v, self.half)
        shifted = np.cumsum(shift, axis=0)  # no joint moved that way
        shift[-1] = 0.0  # nothing bears that one out
        moved = kinematics(
            log.t,
            q - shifted,
            v,
            offset=self.offset,
            half=self.half,
            degree=self.degree,
            step=self.step,
        )
        return Motion(
            log.t,
            moved.q + shifted,
            *moved[1:],
            current=log.joint("actual_current"),
            temperature=log.joint("joint_temperatures"),
            breaks=breaks(log.t, self.step),
            source=log.source,
            shift=without_turns(shift),
        )


def _measured(log: Log, name: str) -> Array:
    """Per-joint channel in which an infinity counts as not measured."""
    values = log.joint(name)
    return np.where(np.isfinite(values), values, np.nan)


def require_measured(log: Log, names: Collection[str] = ("actual_q", "actual_current")) -> None:
    """LogError unless these channels were measured at all, and every joint's angle."""
    for name in names:
        if not np.isfinite(log.joint(name)).any():
            there = ", ".join(sorted(log.channels)) or "no channel at all"
            what = "no finite value" if name in log else "no channel"
            message = f"{what} {name}; there is {there}: name the columns or record it"
            raise LogError(message, log.source.path, column=name)
    for j in np.flatnonzero(~np.isfinite(log.joint("actual_q")).any(axis=0)):
        message = f"no finite value of joint {j} in actual_q: name its column or record it"
        raise LogError(message, log.source.path, column=f"actual_q_{j}")


def _settle(log: Log, offset: ArrayLike, half: int | None, degree: int) -> _Settled:
    """Refuse a log that no motion can be made of, and fix what depends on all of its rows."""
    require_measured(log)
    step = median_step(log.t)
    if not step > 0:
        raise LogError("one row only; a motion needs at least two", log.source.path)
    velocities = bool(np.isfinite(log.joint("actual_qd")).any())
    half = half_window(step, degree, velocities) if half is None else half
    return _Settled(step, half, degree, offset)
