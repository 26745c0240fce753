"""Opens the source that a text names: a recording, or a live robot."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from urdyn.errors import InputError
from urdyn.io.effort import UNTOLD, Effort
from urdyn.signal import Touch
from urdyn.tracking.sources.source import ROS2, SCHEME, Rows, Source, Tell, nobody

ADDRESS = re.compile(r"\d+(\.\d+){3}(:\d+)?|[\w.-]+:\d+")  # of a robot, and hardly a log's name


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
