"""Joint states as they come, from a ROS 2 graph."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from queue import Empty
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.bags.joints import JOINTS, Places, arms, listed
from urdyn.io.ros2.domain import DEEP, reader
from urdyn.types import Array

BATCH = 200  # samples after which DDS is asked for more
RESET = "/urdyn/reset"  # std_msgs/Empty: restart from the commissioned arm


@dataclass(frozen=True, eq=False)
class Heard:
    """One message of the arm's joints, base first."""

    received: float  # [s] on this computer's monotonic clock
    stamp: float  # [s] of its header; of this computer where it has none
    q: Array  # (J,) [rad]
    v: Array  # (J,) [rad/s]
    effort: Array  # (J,) in its publisher's unit
    reset: bool = False  # a reset was requested before it


class Listener:
    """Joint states that have come, as a queue; DDS keeps them until they are asked for.

    It has no thread, which would take the interpreter from the work on the one before.
    """

    def __init__(self, at: Any, topic: str) -> None:
        from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet

        from urdyn.io.ros2 import idl

        self._states, self._resets = reader(at, topic, idl.JointState), reader(at, RESET, idl.Empty)
        self._message, self._reset = idl.JointState, idl.Empty
        self._waiting = WaitSet(at)
        anything = SampleState.Any | ViewState.Any | InstanceState.Any
        self._waiting.attach(ReadCondition(self._states, anything))
        self._understand = Understanding(topic)
        self._came: deque[Heard] = deque()
        self._anew = False  # a reset was requested, and no sample came since
        self._given = 0  # samples, since DDS was asked
        self._asked = time.monotonic()  # [s] when DDS was asked

    def get(self, timeout: float) -> Heard:
        """The next message with the arm's joints in it; queue.Empty if none comes in time [s]."""
        from cyclonedds.util import duration

        if not self._came or self._given >= BATCH:
            self._ask(self._asked)  # samples came after that: they are no older than stated
        end = time.monotonic() + timeout
        while not self._came:
            left = end - time.monotonic()
            if left <= 0.0:
                raise Empty
            if self._waiting.wait(duration(nanoseconds=int(1e9 * left))):
                self._ask(time.monotonic())
        self._given += 1
        return self._came.popleft()

    def empty(self) -> bool:
        """Whether all samples known to have come were given out."""
        return not self._came

    def _ask(self, received: float) -> None:
        """Take all waiting samples, as received at `received` [s]."""
        self._given, self._asked = 0, time.monotonic()
        states = [m for m in self._states.take(N=DEEP) if isinstance(m, self._message)]
        self._anew |= any(isinstance(m, self._reset) for m in self._resets.take(N=BATCH))
        for message in states:  # a non-message: a publisher came or went
            if heard := self._understand(message, received, self._anew):
                self._came.append(heard)
                self._anew = False


class Understanding:
    """Decoded joint states -> the arm's; remembers where its joints stand."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._known: dict[tuple[str, ...], Places] = {}

    def __call__(self, message: Any, received: float, reset: bool) -> Heard | None:
        """The arm's part of a message received at `received` [s]; None: it is of others."""
        names: tuple[str, ...] = tuple(message.name)
        if names not in self._known:
            self._known[names] = _places(names, self._topic)
        places = self._known[names]
        return _heard(message, places, received, reset) if places else None


def _places(names: tuple[str, ...], topic: str) -> Places:
    """Where the arm's joints stand; () where the message is of others, such as a gripper."""
    found = arms(names)
    if len(found) > 1:
        told = listed(f"{prefix}*" for prefix in found)
        raise InputError(f"{topic}: has the joints of several arms ({told}); remap one of them")
    return next(iter(found.values()), ())


def _heard(message: Any, places: Places, received: float, reset: bool) -> Heard:
    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    said = (message.position, message.velocity, message.effort)
    q, v, effort = (
        np.array([series[place] for place in places], dtype=np.float64)
        if len(series) == len(message.name)
        else np.full(len(JOINTS), np.nan)
        for series in said
    )
    return Heard(received, stamp or time.time(), q, v, effort, reset)
