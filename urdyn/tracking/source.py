"""Where samples come from: a recording, or a live robot."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from threading import TIMEOUT_MAX, Event, Thread
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.address import joined
from urdyn.io.clock import SET, credible
from urdyn.io.effort import UNTOLD, Effort
from urdyn.io.rtde.client import Client, Connected, Dropped, connect, parse_address
from urdyn.io.rtde.link import Package
from urdyn.signal import BESIDE, POSE, SETTING, UNSET, Sample
from urdyn.signal.channels import STATUS, undriven
from urdyn.signal.stretches import GAP
from urdyn.types import Log

SCHEME, ROS2 = "rtde://", "ros2://"
ADDRESS = re.compile(r"\d+(\.\d+){3}(:\d+)?|[\w.-]+:\d+")  # of a robot, and hardly a log's name
CHANNELS = ("actual_q", "actual_qd", "actual_current", "joint_temperatures")
PAUSE = 0.1  # [s] without a package, after which their delay is estimated anew
DRIFT = 1e-4  # [-] by which the rates of two clocks may differ
# [s] between packages up to which their reader does not sleep. On two processors of a busy host,
# samples took half as long again if it slept, and 1 in 100 three times as long.
AWAKE = 4e-3
JUDGED = 3.0  # [s] at first, over which a robot's rate is measured
LATEST = 1.0  # [s] by which the last sample may be late
LOOK = 0.1  # [s] between checks for the end, while nothing comes
RTDE_JOINTS = 6
SELDOM = (
    "sends {:.2g} samples a second where {:g} were agreed; so far apart they tell nothing: "
    "ask for fewer by --rate"
)

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
) -> Source:
    """The source that `text` names: a log, rtde://HOST[:PORT] or ros2://TOPIC.

    `rate` [Hz] is that of a log without time stamps, or is requested from a controller; `duration`
    [s] ends the stream; `effort` says what a bag's efforts are; `beside` names streams of `BESIDE`
    to read where available; `tell` is told of a robot that is lost, is back, or restarts;
    `more` are logs that follow that one, in the order of time.
    """
    if not all(x is None or 0 < x < np.inf for x in (duration, rate)):
        raise InputError("duration and rate are to be above 0, and finite")
    if live := [name for name in (text, *more) if more and "://" in name]:
        raise InputError(f"{live[0]}: a robot at work is a source by itself; name logs, or only it")

    def named(said: str) -> None:
        tell(f"{text}: {said}")

    if text.startswith(SCHEME):
        return _robot(text, rate, duration, beside, named)
    if text.startswith(ROS2):
        from urdyn.tracking.ros2_source import graph

        return graph(text, text.removeprefix(ROS2), rate, duration, effort, named)
    if "://" in text:
        told = f"name a log, {SCHEME}HOST[:PORT] or {ROS2}TOPIC"
        raise InputError(f"{text}: no such source; {told}")
    if ADDRESS.fullmatch(text) and not Path(text).exists():
        raise InputError(f"{text}: there is no such file; for a robot write {SCHEME}{text}")
    from urdyn.tracking.recording import recording

    logs = recording((text, *more), columns, rows, rate, duration, effort, beside)
    return replace(logs, tell=named)


def _robot(
    name: str, rate: float | None, duration: float | None, beside: Collection[str], tell: Tell
) -> Source:
    host, port = parse_address(name)
    # Its own poses tell which arm it is, whether or not they are used as a stream.
    asked = [*STATUS, *SETTING, *(BESIDE[stream] for stream in (POSE, *beside))]
    names, optional = ("timestamp", *CHANNELS, *asked), (CHANNELS[1], CHANNELS[3], *asked)
    client = connect(host, port, names, rate, optional=optional, awake=AWAKE)
    period = client.agreement.period
    count = None if duration is None else max(1, round(duration / period))

    def start(_: int) -> Iterator[Arrival]:
        with _closed_after(duration, client):
            yield from islice(_heard(client, tell), count)

    sent = frozenset(s for s in beside if BESIDE[s] not in client.agreement.left_out)
    return Source(
        name=name,
        identity=joined(host, port),
        sha256="",
        period=period,
        joints=RTDE_JOINTS,
        live=True,
        length=count or 0,
        start=start,
        close=client.close,
        velocities=CHANNELS[1] not in client.agreement.left_out,
        beside=sent,
        tell=tell,
    )


@contextmanager
def _closed_after(duration: float | None, client: Client) -> Iterator[None]:
    """Wait little longer than `duration` [s] for a robot that is slow or gone.

    What it has sent by then is read, however late.
    """
    if duration is None:
        yield
        return
    patience, ended = min(duration + LATEST, TIMEOUT_MAX), Event()

    def close() -> None:
        ended.wait(patience)
        while client.unread and not ended.wait(LOOK):
            pass
        client.close()

    Thread(target=close, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


def _heard(client: Client, tell: Tell) -> Iterator[Arrival]:
    """A controller's samples, read between steps: a thread would only compete with these.

    A package's arrival time is its stamp plus the smallest recent delay, so that the time it
    waited to be read counts.
    """
    behind, before = np.inf, np.nan  # [s] our clock minus the controller's, and its last stamp
    for package in _paced(_packages(client, tell), client.agreement.period, tell):
        sample, read = _sample(client.agreement.recipe.unpack(package.values)), package.received
        if not credible(sample.t):
            continue  # counts as lost
        passed = sample.t - before
        known = behind + DRIFT * passed if 0.0 < passed < PAUSE else np.inf
        behind, before = min(known, read - sample.t), sample.t
        yield Arrival(sample, sample.t + behind)


def _paced(packages: Iterator[Package], period: float, tell: Tell) -> Iterator[Package]:
    """The packages; `tell` is told if those of the first seconds are too sparse to learn from."""
    first, count = np.nan, 0
    for package in packages:
        yield package
        first, count = (first if count else package.received), count + 1
        passed = package.received - first
        if passed > JUDGED:
            if passed > GAP * period * (count - 1):
                tell(SELDOM.format((count - 1) / passed, 1.0 / period))
            break
    yield from packages


def _packages(client: Client, tell: Tell) -> Iterator[Package]:
    """A controller's packages; `tell` is told when it is lost, and when it is back."""
    lost = False
    for event in client.events():
        match event:
            case Package():
                yield event
            case Dropped():
                lost = True
                tell(f"{event.reason}; waiting for it")
            case Connected() if lost:
                lost = False
                tell("is back")


def _sample(values: dict[str, Any]) -> Sample:
    nothing = np.full(RTDE_JOINTS, np.nan)
    t = float(values["timestamp"])
    q, v, current, temperature = (values.get(name, nothing) for name in CHANNELS)
    told = ((stream, values.get(name)) for stream, name in BESIDE.items())
    whole = values.keys() >= SETTING.keys()  # controllers report both or neither
    beside = {
        stream: np.concatenate([[t], six, *([q] if stream == POSE else [])])[None]
        for stream, six in told
        if six is not None
    }
    setting = np.array([values["payload"], *values["payload_cog"]]) if whole else UNSET
    passive = undriven(*(values.get(name, np.nan) for name in STATUS))
    return Sample(t, q, v, nothing if passive else current, temperature, beside, setting, passive)


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
