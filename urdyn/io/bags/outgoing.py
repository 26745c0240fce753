"""What we write to a bag: topics, and their messages by time.

A log becomes `/rtde`, with every channel (see `sample`), and where it has joint angles also
`/joint_states`, as every ROS tool knows it. What is not a robot's own stream, such as a history,
becomes `/urdyn/history`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from urdyn.io.bags import joint_states, sample
from urdyn.io.bags.forms import require
from urdyn.io.bags.joints import JOINTS
from urdyn.types import Array

LATEST = 2**63 - 1  # [ns] that a bag can store
SECONDS = 2**31 - 1  # [s] that a header can store

Channels = Mapping[str, Array]  # RTDE name -> (N,) or (N, width), `timestamp` among them
Message = tuple[int, int, bytes]  # index of its topic, [ns], CDR


@dataclass(frozen=True)
class Outgoing:
    """A topic that we write."""

    topic: str
    type: str
    definition: str
    digest: str  # RIHS01_...

    @staticmethod
    def standard(topic: str, type_: str) -> Outgoing:
        """A topic of a type that every ROS installation has."""
        store = typestore()
        text, _ = store.generate_msgdef(type_, ros_version=2)
        return Outgoing(topic, type_, text, store.hash_rihs01(type_))


@dataclass(frozen=True)
class Told:
    """All that goes into one bag."""

    topics: tuple[Outgoing, ...]
    messages: Iterator[Message]


def typestore() -> Any:
    """The common types of ROS 2, as rosbags knows them."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def told(parts: Iterable[Channels]) -> Told:
    """A log, given as stretches of rows; the first defines the channels."""
    require("rosbags")
    stretches = iter(parts)
    first = next(stretches)
    robot = "actual_q" in first and first["actual_q"].shape[1:] == (len(JOINTS),)
    topics = [_samples("/rtde" if "actual_q" in first else "/urdyn/history", first)]
    if robot:
        topics.append(Outgoing.standard("/joint_states", joint_states.TYPE))
    every = chain([first], stretches)
    return Told(tuple(topics), (m for part in every for m in _messages(part, robot)))


def nanoseconds(t: Array) -> NDArray[np.int64]:
    """Stamps as bags store time, (N,) [ns]; negative ones become zero."""
    return np.rint(np.clip(t, 0.0, LATEST / 1e9) * 1e9).astype(np.int64)


def _samples(topic: str, channels: Channels) -> Outgoing:
    from rosbags.typesys import get_types_from_msg

    text = sample.definition(sample.widths(channels))
    store = typestore()
    store.register(get_types_from_msg(text, sample.TYPE))
    return Outgoing(topic, sample.TYPE, text, store.hash_rihs01(sample.TYPE))


def _messages(part: Channels, robot: bool) -> Iterator[Message]:
    stamps = nanoseconds(part["timestamp"]).tolist()
    rows = sample.messages(part)
    if not robot:
        yield from ((0, stamp, row) for stamp, row in zip(stamps, rows, strict=True))
        return
    for stamp, row, state in zip(stamps, rows, _joint_states(part), strict=True):
        yield 0, stamp, row
        yield 1, stamp, state


def _joint_states(part: Channels) -> Iterator[bytes]:
    """JointState of every row: the same bytes but for the stamp and three arrays at the end."""
    q = part["actual_q"]
    nothing = np.full_like(q, np.nan)
    v, i = (part.get(name, nothing) for name in ("actual_qd", "actual_current"))
    template = np.frombuffer(_template(), np.uint8)
    rows = np.tile(template, (len(q), 1))
    rows[:, 4:12] = _stamps(part["timestamp"])
    size, length = 8 * len(JOINTS), 8  # [bytes] of an array, and of its length before it
    for place, values in enumerate((i, v, q)):
        stop = len(template) - place * (size + length)
        cells = np.ascontiguousarray(values.astype("<f8")).view(np.uint8)
        rows[:, stop - size : stop] = cells
    return (row.tobytes() for row in rows)


def _stamps(t: Array) -> NDArray[np.uint8]:
    """Seconds and nanoseconds of a header, (N, 8) bytes."""
    ns = np.minimum(nanoseconds(t), SECONDS * 1_000_000_000)
    pair = np.stack([ns // 1_000_000_000, ns % 1_000_000_000], axis=1).astype("<u4")
    return np.ascontiguousarray(pair).view(np.uint8)


def _template() -> bytes:
    store = typestore()
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](0, 0)
    header = types["std_msgs/msg/Header"](stamp, "")
    zero = np.zeros(len(JOINTS))
    message = types[joint_states.TYPE](header, list(JOINTS), zero, zero, zero)
    return bytes(store.serialize_cdr(message, joint_states.TYPE))
