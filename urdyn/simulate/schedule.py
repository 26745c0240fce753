"""An arm's course over time: everything that varies, as arrays over given times.

An event is anything that changes this course: a fault, a payload that is picked up, a room that
gets warmer. Both fidelities and the truth file read the same course.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from urdyn.errors import InputError
from urdyn.model.dynamics import Dynamics
from urdyn.types import Array, Mask

BEYOND = 1e9  # beyond any possible value, in any unit of a course

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True, eq=False)
class Course:
    """The state of an arm at times t; where nothing happens, arrays are views of one constant.

    Read-only, but not copied: `without_events` makes the constants, events replace them.
    """

    t: Array  # (N,) [s]
    coulomb: Array  # (N, J) [-], times the drive's
    viscous: Array  # (N, J) [-], times the drive's; by wear and warmth
    health: Array  # (N, J) [-], z itself
    half_gap: Array  # (N, J) [rad] of backlash, to either side
    encoder_offset: Array  # (N, J) [rad], reported angle minus true
    payload: Array  # (N, 10) inertials in the last joint's frame
    push: Array  # (N, J, 6) [N, N·m] on the middle of each link, in the base's axes
    loop_gain: Array  # (N, J) [-], times the controller's
    loop_delay: Array  # (N,) [s], beyond the controller's
    ambient: Array  # (N,) [K] by which the room is warmer than initially
    temperature: Array  # (N, J) [°C] of the joints, at their sensors
    sensor_bias: Array  # (N, J) [A] on the reported current
    sensor_noise: Array  # (N, J) [A] sd of additional white noise
    sensor_stuck: Mask  # (N, J) the last report of the current is repeated
    sensor_dropped: Mask  # (N, J) no current is reported

    def __len__(self) -> int:
        return len(self.t)

    def since(self, row: int) -> Course:
        """Without the rows before `row`; arrays are views."""
        return replace(self, **{f.name: getattr(self, f.name)[row:] for f in fields(self)})


class Event(Protocol):
    """Something that happens to an arm."""

    @property
    def onset(self) -> float:
        """Time before which nothing changes [s]."""
        ...

    def befall(self, course: Course) -> Course:
        """The course with the event in it."""
        ...


def course(dynamics: Dynamics, events: Iterable[Event], t: Array) -> Course:
    """The course of an arm at any times t (N,) [s]; of two events the later one prevails.

    Pieces that a program handles add to whatever the tool carries.

    Raises:
        InputError: an event is, or becomes, impossibly large.
    """
    return befallen(without_events(dynamics, t), events)


def befallen(changed: Course, events: Iterable[Event]) -> Course:
    """The course with the events in it, in the order that `course` says, and its errors."""
    for event in sorted(events, key=lambda event: (isinstance(event, Handling), event.onset)):
        before = changed
        with np.errstate(over="ignore", invalid="ignore"):  # reported below
            changed = event.befall(before)
        _require_possible(changed, before, event)
    return changed


def _require_possible(now: Course, before: Course, event: Event) -> None:
    for name in (field.name for field in fields(now)):
        values = getattr(now, name)
        if values is not getattr(before, name) and not (np.abs(values) < BEYOND).all():
            what = f"what begins at {event.onset:g} s makes {name} more than {BEYOND:g}"
            raise InputError(f"{what}, which no arm has; let it be smaller, or grow for less long")


def without_events(dynamics: Dynamics, t: Array) -> Course:
    """The course without events."""
    drive, joints = dynamics.drive, dynamics.arm.joints

    def always(value: Array | float, *shape: int) -> Array:
        return np.broadcast_to(value, (len(t), *shape))

    never = np.broadcast_to(False, (len(t), joints))
    return Course(
        t=t,
        coulomb=always(1.0, joints),
        viscous=always(1.0, joints),
        health=always(drive.health, joints),
        half_gap=always(0.0, joints),
        encoder_offset=always(0.0, joints),
        payload=always(dynamics.payload, 10),
        push=always(0.0, joints, 6),
        loop_gain=always(1.0, joints),
        loop_delay=always(0.0),
        ambient=always(0.0),
        temperature=always(drive.temperature, joints),
        sensor_bias=always(0.0, joints),
        sensor_noise=always(0.0, joints),
        sensor_stuck=never,
        sensor_dropped=never,
    )


def at_joint(values: NDArray[Scalar], joint: int, column: NDArray[Scalar]) -> NDArray[Scalar]:
    """`values` (N, J, ...) with one joint's column replaced."""
    changed = np.array(values)
    changed[:, joint] = column
    return changed


@dataclass(frozen=True, eq=False)
class Handling:
    """What a program picks up and puts down, in addition to the tool's payload at that time."""

    begin: Array  # (K,) [s], increasing
    carried: Array  # (K, 10) inertials from then on

    @property
    def onset(self) -> float:
        """Time of the first change [s]."""
        return float(self.begin[0])

    def befall(self, course: Course) -> Course:
        """The piece at any time is that of the last change before it."""
        pieces = np.vstack([np.zeros(10), self.carried])
        now = np.searchsorted(self.begin, course.t, side="right")
        return replace(course, payload=course.payload + pieces[now])
