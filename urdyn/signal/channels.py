"""Which channels of a log are measurements, and which are states that must not be averaged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.types import Array, Defect, Log, Mask

SENSORS = (
    "actual_q",
    "actual_qd",
    "actual_current",
    "actual_TCP_force",
    "joint_temperatures",
)  # section IV.B: positions, velocities, currents, force/torque, temperatures
MOTION = ("actual_q", "actual_qd")  # a joint's motion, measured twice

# Bounds on angles [rad], speeds [rad/s], currents [A] and temperatures [°C]. The quickest wrist of
# a UR turns by 6.3 rad/s.
POSSIBLE = np.array([1e4, 30.0, 1e4, 200.0])

# Channels that tell that an arm does not move itself: its mode is not RUNNING, as without power or
# in backdrive; or a bit says that the teach button is pressed. Both as in UR's RTDE guide.
STATUS = ("robot_mode", "robot_status_bits")
RUNNING, TEACHING = 7, 4
# Not 0 while the arm works in contact: what `Touch` marks, or a log's own channel of that name.
IN_CONTACT = "contact_state"
UNKNOWN = np.array(np.nan)

_STATES = ("mode", "status", "state", "bits", "register", "reversal", "standstill")


def is_state(name: str) -> bool:
    """Whether a channel holds codes or flags: between 3 and 7 there is no robot_mode 5."""
    return any(word in name for word in _STATES)


def undriven(mode: Any, bits: Any) -> Any:
    """Whether a hand moves the arm, or its drives have no power; numbers, or (N,); NaN: unknown.

    Currents then do not tell its motion. An arm that is jogged moves itself, although no program
    runs.
    """
    return (mode < RUNNING) | (mode > RUNNING) | (bits // TEACHING % 2 == 1)


def ever_undriven(log: Log) -> Mask:
    """Rows of a log in which it is `undriven`, (N,); none where the log does not say."""
    mode, bits = (_told(log, name) for name in STATUS)
    return np.broadcast_to(np.asarray(undriven(mode, bits)), len(log))


def ever_in_contact(log: Log) -> Mask:
    """Rows of a log in which its arm works in contact, (N,); none where the log does not say."""
    told = _told(log, IN_CONTACT)
    return np.broadcast_to(np.isfinite(told) & (told != 0.0), len(log))


def _told(log: Log, name: str) -> Array:
    """A channel of one number a row, (N,); NaN where there is none."""
    values = log.channels.get(name, UNKNOWN)
    return values if values.ndim < 2 else UNKNOWN


def named(log: Log, channels: Iterable[str]) -> list[str]:
    """Which of these a log has; InputError at one that it lacks and that is not a sensor's."""
    names = [channels] if isinstance(channels, str) else list(channels)
    for name in names:
        if name not in log and name not in SENSORS:
            there = ", ".join(sorted(log.channels)) or "none"
            raise InputError(f"channel {name!r} is not in the log; there is {there}")
    return [name for name in names if name in log]


def has_motion(log: Log) -> bool:
    """Whether a log has both channels of MOTION."""
    return all(name in log for name in MOTION)


def has_velocities(log: Log) -> bool:
    """Whether any velocity was measured."""
    return bool(np.isfinite(log.joint("actual_qd")).any())


def is_pose(name: str, values: Array) -> bool:
    """Whether a channel is places [m] and rotation vectors [rad], (N, 6)."""
    return name.endswith("TCP_pose") and values.shape[1:] == (6,)


def columns(values: Array) -> Array:
    """A channel as (N, width), whether it was that or (N,)."""
    return values if values.ndim > 1 else values[:, None]


def by_column(values: Array, change: Callable[[Array], Array]) -> Array:
    """`change` applied to every column (N,) of `values`, (N,) or (N, width)."""
    changed = [change(column) for column in columns(values).T]
    return np.stack(changed, axis=1) if values.ndim > 1 else changed[0]


def mean_measured(values: Array) -> Array:
    """Mean of every column of `values` (N, width) over what was measured, NaN where nothing was."""
    told = np.isfinite(values)
    count = np.where(told.any(axis=0), told.sum(axis=0), np.nan)
    return np.asarray(np.where(told, values, 0.0).sum(axis=0) / count)


def noted(log: Log, kind: str, count: int, remedy: str) -> tuple[Defect, ...]:
    """The log's defects and one more, if there is anything to count."""
    return (*log.defects, Defect(kind, count, 0, remedy)) if count else log.defects


def without(log: Log, ill: Mask, kind: str) -> Log:
    """A log in which these values of MOTION, (2, N, J), count as not measured, and are counted."""
    if not (count := int(np.count_nonzero(ill))):
        return log
    each = zip(MOTION, ill, strict=True)
    told = {name: np.where(wrong, np.nan, log.channels[name]) for name, wrong in each}
    defects = noted(log, kind, count, "taken as not measured")
    return replace(log, channels={**log.channels, **told}, defects=defects)
