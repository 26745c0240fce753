"""A live robot on a ROS 2 graph."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from queue import Empty
from threading import Event
from typing import Protocol

import numpy as np

from urdyn.errors import InputError
from urdyn.io.bags.joints import JOINTS
from urdyn.io.effort import Effort
from urdyn.io.ros2.domain import participant
from urdyn.io.ros2.listen import Heard, Listener
from urdyn.signal import Sample
from urdyn.tracking.sources.source import LATEST, LOOK, Arrival, Source, Tell, nobody, now, was_set

PATIENCE = 10.0  # [s] for the first joint states
FIRST = 10  # samples that tell the rate: few, as a live robot does not wait
SILENT = 5.0  # [s] without a message, after which the user is told
SHORT = 1.25  # periods: a sample this close to the end of the stretch is its last


class Inbox(Protocol):
    """Where messages arrive: a queue, or DDS itself."""

    def get(self, *, timeout: float) -> Heard:
        """The next one; queue.Empty if there is none in time [s]."""

    def empty(self) -> bool:
        """Whether there is none now."""


def graph(
    name: str, topic: str, rate: float | None, duration: float | None, effort: Effort, tell: Tell
) -> Source:
    """The joint states of a topic; the first samples tell the `rate` [Hz] where it is not given."""
    effort.told(name)
    listener = Listener(participant(), topic or "joint_states")
    return hearing(name, listener, Event(), effort, rate, duration, tell)


def hearing(
    name: str,
    inbox: Inbox,
    ended: Event,
    effort: Effort,
    rate: float | None = None,
    duration: float | None = None,
    tell: Tell = nobody,
) -> Source:
    """The source of the messages in `inbox`, until `ended` is set.

    A driver that is gone is waited for little longer than `duration` [s]; `tell` reports it.
    """
    try:
        first = _first(inbox, name, FIRST if rate is None else 1)
        period = 1.0 / rate if rate else _period(first, name)
    except BaseException:
        ended.set()
        raise
    count = 0 if duration is None else max(1, round(duration / period))
    lasts = np.inf if duration is None else duration
    last, end = first[0].stamp + lasts - SHORT * period, first[0].received + lasts + LATEST

    def start(_: int) -> Iterator[Arrival]:
        heard = _until(last, chain(first, _heard(inbox, ended, end, tell)))
        return (_arrival(one, effort) for one in heard)

    return Source(
        name=name,
        identity=name,
        sha256="",
        period=period,
        joints=len(JOINTS),
        live=True,
        length=count,
        start=start,
        close=ended.set,
        tell=tell,
        velocities=any(np.isfinite(heard.v).any() for heard in first),
    )


def _first(inbox: Inbox, name: str, count: int) -> list[Heard]:
    came: list[Heard] = []
    while len(came) < count:
        try:
            came.append(inbox.get(timeout=PATIENCE))
        except Empty:
            raise InputError(
                f"{name}: no joint states of an arm in {PATIENCE:.0f} s; does the driver run, and "
                "is ROS_DOMAIN_ID the same?"
            ) from None
    return came


def _period(first: list[Heard], name: str) -> float:
    """Slope of the line through the stamps, each step counted by its size: some may be missing."""
    stamps = np.array([heard.stamp for heard in first])
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    if not usual > 0.0:
        raise InputError(f"{name}: its stamps do not run forward; is another node publishing too?")
    count = np.concatenate([[0.0], np.round(steps / usual).cumsum()])
    count -= count.mean()
    return float(count @ (stamps - stamps[0]) / (count @ count))


def _until(last: float, heard: Iterable[Heard]) -> Iterator[Heard]:
    """Samples up to the first stamped `last` [s] or later, by a clock that may be set."""
    stamp = received = np.nan
    for one in heard:
        yield one
        step = one.stamp - stamp
        if was_set(step, received):
            last += step
        stamp, received = one.stamp, one.received
        if stamp >= last:
            return


def _heard(inbox: Inbox, ended: Event, end: float, tell: Tell) -> Iterator[Heard]:
    """Messages until `ended` is set, or until none comes after `end` [s] on our clock."""
    silent = 0.0  # [s] of polls in vain: time without polling does not count
    while not (ended.is_set() and inbox.empty()):
        try:
            one = inbox.get(timeout=LOOK)
        except Empty:
            if now() > end:
                return
            if silent < SILENT <= silent + LOOK:
                tell(f"silent for {SILENT:g} s; does the driver run? waiting for it")
            silent += LOOK
            continue
        if silent >= SILENT:
            tell("is back")
        silent = 0.0
        yield one


def _arrival(heard: Heard, effort: Effort) -> Arrival:
    nothing = np.full(len(JOINTS), np.nan)  # the driver publishes no temperatures
    sample = Sample(heard.stamp, heard.q, heard.v, effort.current(heard.effort), nothing)
    return Arrival(sample, heard.received, heard.reset)
