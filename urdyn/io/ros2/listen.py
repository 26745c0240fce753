"""Joint states as they come, from a ROS 2 graph."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from threading import Event
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.bags.joints import JOINTS, Places, arms, listed
from urdyn.io.ros2.domain import reader
from urdyn.types import Array

LOOK = 100  # [ms] between looks for the end, while nothing comes
BATCH = 200  # samples that are taken at once
RESET = "/urdyn/reset"  # std_msgs/Empty: begin anew with the commissioned arm


@dataclass(frozen=True)
class Heard:
    """One message of the arm's joints, base first."""

    received: float  # [s] on this computer's monotonic clock
    stamp: float  # [s] of its header; of this computer where it has none
    q: Array  # (J,) [rad]
    v: Array  # (J,) [rad/s]
    effort: Array  # (J,) in the unit of who published it
    reset: bool = False  # somebody asked to begin anew before it


def joint_states(at: Any, topic: str, ended: Event) -> Iterator[Heard]:
    """Every message with the arm's joints in it, until `ended` is set."""
    from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
    from cyclonedds.util import duration

    from urdyn.io.ros2 import idl

    states, resets = reader(at, topic, idl.JointState), reader(at, RESET, idl.Empty)
    anything = SampleState.Any | ViewState.Any | InstanceState.Any
    waiting = WaitSet(at)
    waiting.attach(ReadCondition(states, anything))
    understand = Understanding(topic)
    while not ended.is_set():
        if not waiting.wait(duration(milliseconds=LOOK)):
            continue
        came: list[Any] = [m for m in states.take(N=BATCH) if isinstance(m, idl.JointState)]
        received = time.monotonic()
        reset = any(isinstance(m, idl.Empty) for m in resets.take(N=BATCH))
        for message in came:  # what is no message tells that a publisher came or went
            if heard := understand(message, received, reset):
                yield heard
                reset = False


class Understanding:
    """Joint states, whoever decoded them, as the arm's; where its joints stand is remembered."""

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._known: dict[tuple[str, ...], Places] = {}

    def __call__(self, message: Any, received: float, reset: bool) -> Heard | None:
        """What a message that came at `received` [s] tells of the arm; None: it is of others."""
        names: tuple[str, ...] = tuple(message.name)
        if names not in self._known:
            self._known[names] = _places(names, self._topic)
        places = self._known[names]
        return _heard(message, places, received, reset) if places else None


def _places(names: tuple[str, ...], topic: str) -> Places:
    """Where the arm's joints stand; () where the message is of others, a gripper's say."""
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
