"""What else a robot publishes on ROS topics: wrench, TCP pose, speed scaling, temperatures.

Every stream has a rate of its own; on the clock of the joint states it holds its last value.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.errors import LogError
from urdyn.io.bags.joints import JOINTS, number
from urdyn.io.bags.messages import Bag, Topic, header_stamp
from urdyn.types import Array, Index

STALE = 5.0  # median steps of a stream after which its last value no longer holds
PERCENT = "speed_scaling"  # UR's ROS 2 driver; `speed_scaling_factor` of ROS 1 is a fraction
AIMS = re.compile(r"(?i)target|command|goal|desired")  # names of commands, not measurements
TOOL, BASE = "tool0_controller", "base"  # frames of the controller's own TCP pose on /tf

Said = tuple[Array, str]  # values (width,), NaN where missing, and their frame
Row = tuple[int, Array, str]  # stamp [ns], values and frame
Hear = Callable[[Topic, Any], Iterator[Said]]


@dataclass(frozen=True, eq=False)
class Stream:
    """One channel, at its own rate."""

    stamp: Index  # (M,) [ns] by the joint states' clock, in order
    values: Array  # (M, width)
    frame: str  # whose axes, of the first message; "" where not given

    def at(self, stamp: Index) -> Array:
        """Last values at these stamps [ns], (N, width); NaN before the first, and where stale."""
        told = [self._held(column, stamp) for column in self.values.T]
        return np.stack(told, axis=1)

    def _held(self, column: Array, stamp: Index) -> Array:
        spoken = np.isfinite(column)
        when, what = self.stamp[spoken], column[spoken]
        if not len(when):
            return np.full(len(stamp), np.nan)
        last = np.searchsorted(when, stamp, side="right") - 1
        patience = STALE * np.median(np.diff(when)) if len(when) > 1 else np.inf
        fresh = (last >= 0) & (stamp - when[last] <= patience)
        return np.where(fresh, what[last], np.nan)


def streams(bag: Bag, offset: int) -> dict[str, Stream]:
    """RTDE name -> stream; the joint states' clock is `offset` [ns] ahead of the bag's.

    Where topics of several types carry a channel, the first of _TABLE is used.

    Raises:
        LogError: two topics of a type carry the same channel.
    """
    found: dict[str, Stream] = {}
    for type_, name, channel, hear in _TABLE:
        if channel in found:
            continue
        heard = {
            topic.name: _rows(bag, topic, hear, offset)
            for topic in bag.topics
            if topic.type == type_ and re.search(name, topic.name) and not AIMS.search(topic.name)
        }
        told = {topic: rows for topic, rows in heard.items() if rows}
        if len(told) > 1 and hear is not _temperature:  # which has one topic per joint
            several = ", ".join(sorted(told))
            hint = "keep one of them in the bag"
            raise LogError(f"has more than one {channel} ({several}); {hint}", bag.path)
        if told:
            found[channel] = _stream([row for rows in told.values() for row in rows])
    return found


def _rows(bag: Bag, topic: Topic, hear: Hear, offset: int) -> list[Row]:
    """All rows of a topic."""
    rows: list[Row] = []
    for recorded, message in bag.messages(topic):
        stamp = header_stamp(message) if topic.type in _STAMPED else 0
        rows.extend((stamp or recorded + offset, *said) for said in hear(topic, message))
    return rows


def _stream(rows: list[Row]) -> Stream:
    rows = sorted(rows, key=lambda row: row[0])
    return Stream(
        np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), rows[0][2]
    )


def _wrench(_: Topic, message: Any) -> Iterator[Said]:
    force, torque = message.wrench.force, message.wrench.torque
    values = [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    yield np.array(values), message.header.frame_id


def _pose(_: Topic, message: Any) -> Iterator[Said]:
    yield _rotation_vector(message.pose.position, message.pose.orientation), message.header.frame_id


def _transforms(_: Topic, message: Any) -> Iterator[Said]:
    for one in message.transforms:
        parent = one.header.frame_id
        if one.child_frame_id.endswith(TOOL) and parent.endswith(BASE):
            yield _rotation_vector(one.transform.translation, one.transform.rotation), parent


def _rotation_vector(place: Any, turn: Any) -> Array:
    """Position [m] and rotation vector [rad], as RTDE gives a pose, (6,)."""
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    if not np.linalg.norm(quaternion) > 0.5:  # all zeros, or NaN: no rotation at all
        return np.full(6, np.nan)
    return np.array([place.x, place.y, place.z, *Rotation.from_quat(quaternion).as_rotvec()])


def _scaling(topic: Topic, message: Any) -> Iterator[Said]:
    whole = 100.0 if topic.name.rpartition("/")[2] == PERCENT else 1.0
    yield np.array([message.data / whole]), ""


def _temperatures(_: Topic, message: Any) -> Iterator[Said]:
    """One value per joint, base first [°C]."""
    if len(message.data) == len(JOINTS):
        yield np.asarray(message.data, dtype=np.float64), ""


def _temperature(topic: Topic, message: Any) -> Iterator[Said]:
    """Temperature [°C] of the joint that the frame, or the topic, is named after."""
    words = [message.header.frame_id, *reversed(topic.name.split("/"))]
    joint = next((k for word in words if (k := number(word)) is not None), None)
    if joint is not None:
        yield _of_joint({joint: message.temperature}), ""


def _interfaces(_: Topic, message: Any) -> Iterator[Said]:
    """Temperatures [°C] in ros2_control's dynamic joint states, where joints have them."""
    told = {
        joint: value
        for name, values in zip(message.joint_names, message.interface_values, strict=False)
        for kind, value in zip(values.interface_names, values.values, strict=False)
        if kind == "temperature" and (joint := number(name)) is not None
    }
    if told:
        yield _of_joint(told), ""


def _of_joint(told: dict[int, float]) -> Array:
    return np.array([told.get(k, np.nan) for k in range(len(JOINTS))])


_TABLE: tuple[tuple[str, str, str, Hear], ...] = (
    ("geometry_msgs/msg/WrenchStamped", "", "actual_TCP_force", _wrench),
    ("geometry_msgs/msg/PoseStamped", r"(?i)tcp.*pose|tool.*pose", "actual_TCP_pose", _pose),
    ("tf2_msgs/msg/TFMessage", r"(^|/)tf$", "actual_TCP_pose", _transforms),
    ("std_msgs/msg/Float64", r"speed_scaling(_factor)?$", "speed_scaling", _scaling),
    ("std_msgs/msg/Float64MultiArray", "temperature", "joint_temperatures", _temperatures),
    ("std_msgs/msg/Float32MultiArray", "temperature", "joint_temperatures", _temperatures),
    ("sensor_msgs/msg/Temperature", "", "joint_temperatures", _temperature),
    ("control_msgs/msg/DynamicJointState", "", "joint_temperatures", _interfaces),
)
_STAMPED = (
    "geometry_msgs/msg/WrenchStamped",
    "geometry_msgs/msg/PoseStamped",
    "sensor_msgs/msg/Temperature",
    "control_msgs/msg/DynamicJointState",
)
