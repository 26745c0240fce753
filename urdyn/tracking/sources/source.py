"""Where samples come from: a recording, or a live robot."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from urdyn.errors import InputError
from urdyn.io.clock import SET
from urdyn.io.effort import UNTOLD, Effort
from urdyn.signal import Sample, Touch
from urdyn.types import Log

SCHEME, ROS2 = "rtde://", "ros2://"
ADDRESS = re.compile(r"\d+(\.\d+){3}(:\d+)?|[\w.-]+:\d+")  # of a robot, and hardly a log's name
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


def open_source(
    text: str,
    columns: str | None = None,
    rows: Rows | None = None,
    rate: float | None = None,
    duration: float | None = None,
    effort: Effort = UNTOLD,
    beside: Collection[str] = (),
    tell: Tell = nobody,
    more: Sequence[str] = (),
    contact: Touch | None = None,
) -> Source:
    """The source that `text` names: a log, rtde://HOST[:PORT] or ros2://TOPIC.

    `rate` [Hz] is that of a log without time stamps, or is requested from a controller; `duration`
    [s] ends the stream; `effort` says what a bag's efforts are; `beside` names streams of `BESIDE`
    to read where available; `tell` is told of a robot that is lost, is back, or restarts;
    `more` are logs that follow that one, in the order of time; `contact` tells when the arm works
    in contact.
    """
    if not all(x is None or 0 < x < np.inf for x in (duration, rate)):
        raise InputError("duration and rate are to be above 0, and finite")
    if live := [name for name in (text, *more) if more and "://" in name]:
        raise InputError(f"{live[0]}: a robot at work is a source by itself; name logs, or only it")

    def named(said: str) -> None:
        tell(f"{text}: {said}")

    if text.startswith(SCHEME):
        from urdyn.tracking.sources.rtde_source import robot

        return robot(text, rate, duration, beside, named, contact)
    if text.startswith(ROS2):
        if contact:
            raise InputError(f"{text}: {contact.unknown}")
        from urdyn.tracking.sources.ros2_source import graph

        return graph(text, text.removeprefix(ROS2), rate, duration, effort, named)
    if "://" in text:
        told = f"name a log, {SCHEME}HOST[:PORT] or {ROS2}TOPIC"
        raise InputError(f"{text}: no such source; {told}")
    if ADDRESS.fullmatch(text) and not Path(text).exists():
        raise InputError(f"{text}: there is no such file; for a robot write {SCHEME}{text}")
    from urdyn.tracking.sources.recording import recording

    logs = recording((text, *more), columns, rows, rate, duration, effort, beside, contact)
    return replace(logs, tell=named)


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
