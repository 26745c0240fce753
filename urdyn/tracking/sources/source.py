"""Where samples come from: a recording, or a live robot."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from urdyn.io.clock import SET
from urdyn.signal import Sample
from urdyn.types import Log

SCHEME, ROS2 = "rtde://", "ros2://"
CHANNELS = ("actual_q", "actual_qd", "actual_current", "joint_temperatures")
LATEST = 1.0  # [s] by which the last sample may be late
LOOK = 0.1  # [s] between checks for the end, while nothing comes

Rows = tuple[int | None, int | None]
Tell = Callable[[str], None]


def nobody(said: str) -> None:
    """A `Tell` that ignores what it is told."""


@dataclass(frozen=True)
class Arrival:
    """A sample, and when it came."""

    sample: Sample
    received: float = np.nan  # [s] on this computer's monotonic clock; NaN: recorded
    reset: bool = False  # a restart was requested before it
    ahead: float = 0.0  # [s] by which its stamp is ahead of the robot's clock, if that was set


@dataclass(frozen=True, eq=False)
class Source:
    """A stream of samples; a recorded one can start at any of them."""

    name: str  # as the user named it
    identity: str  # sha256 and rows of a log, or a robot's address: a resumed run compares it
    sha256: str  # of a log's bytes; "" of a live robot
    period: float  # [s] nominal, between samples
    joints: int
    live: bool
    length: int  # samples; 0: unknown
    start: Callable[[int], Iterator[Arrival]]  # from this sample on; a live one starts now
    close: Callable[[], None]  # end a live stream cleanly, from any thread
    defects: tuple[str, ...] = ()  # damage found while reading it
    velocities: bool = True  # whether they are measured
    beside: frozenset[str] = frozenset()  # streams that its samples may contain
    glimpse: Log | None = None  # a few rows of a log, to tell whose it is
    tell: Tell = nobody  # told of a robot that is lost or back, and of what its run will lack


def now() -> float:
    """The clock that arrivals are stamped by [s]."""
    return time.monotonic()


def was_set(step: float, received: float) -> bool:
    """Whether a clock was set between two stamps, the second `step` [s] after the first.

    It was if it ran backwards, or forwards by more than the time since the first arrived.

    Args:
        received: when the first arrived [s]; NaN: unknown.
    """
    return step < 0.0 or step - (now() - received) > SET
