"""Bags as robots' drivers make them, small and known to the last digit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from urdyn.io.bags.joints import JOINTS

STORE = get_typestore(Stores.ROS2_HUMBLE)
ROS1 = get_typestore(Stores.ROS1_NOETIC)
BEGAN = 1_700_000_000_000_000_000  # [ns] when recording began
LATE = 3_000_000  # [ns] from a stamp to its recording

Telling = tuple[str, str, int, Any]  # topic, type, recorded [ns], message


def make(type_: str, *values: Any, store: Any = STORE) -> Any:
    return store.types[type_](*values)


def header(ns: int, frame: str = "") -> Any:
    stamp = make("builtin_interfaces/msg/Time", ns // 10**9, ns % 10**9)
    return make("std_msgs/msg/Header", stamp, frame)


def values(k: int) -> np.ndarray:
    """Position, velocity and effort of message `k`, base first, (3, 6)."""
    return np.arange(18.0).reshape(3, 6) / 7 + k / 1000


def joint_states(
    count: int,
    names: Sequence[str] = JOINTS,
    order: Sequence[int] = range(6),
    topic: str = "/joint_states",
    stamped: bool = True,
    period: int = 2_000_000,
) -> list[Telling]:
    """`names[k]` is the joint `order[k]` of the arm."""
    told = []
    for k in range(count):
        stamp = BEGAN + k * period
        rows = [row[list(order)] for row in values(k)]
        message = make(
            "sensor_msgs/msg/JointState", header(stamp if stamped else 0), list(names), *rows
        )
        told.append((topic, "sensor_msgs/msg/JointState", stamp + LATE, message))
    return told


def bag(path: Path, told: Iterable[Telling], plugin: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    with Writer(path, version=8, storage_plugin=plugin) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for topic, type_, ns, message in told:
            if (topic, type_) not in connections:
                connections[topic, type_] = writer.add_connection(topic, type_, typestore=STORE)
            writer.write(connections[topic, type_], ns, STORE.serialize_cdr(message, type_))
    return path


def mcap(path: Path, told: Iterable[Telling]) -> Path:
    return bag(path, told, StoragePlugin.MCAP)


def bag1(path: Path, told: Iterable[Telling]) -> Path:
    """The same in a bag of ROS 1."""
    with Writer1(path.with_suffix(".bag")) as writer:
        connections: dict[str, Any] = {}
        for topic, type_, ns, message in told:
            stamp = ROS1.types["builtin_interfaces/msg/Time"](
                message.header.stamp.sec, message.header.stamp.nanosec
            )
            head = ROS1.types["std_msgs/msg/Header"](0, stamp, message.header.frame_id)
            fields = [getattr(message, f) for f in ("name", "position", "velocity", "effort")]
            ros1 = ROS1.types[type_](head, *fields)
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, type_, typestore=ROS1)
            writer.write(connections[topic], ns, ROS1.serialize_ros1(ros1, type_))
    return path.with_suffix(".bag")


MAKERS: dict[str, Callable[[Path, Iterable[Telling]], Path]] = {
    "sqlite3": bag,
    "mcap": mcap,
    "ros1": bag1,
}
