"""Snapshots -> ROS 2 topics; the same for DDS and for the node."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from urdyn.io.ros2.compose import Types
from urdyn.io.ros2.domain import reader, ros_name, writer
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Level, Status
from urdyn.types import Array

DIAGNOSTICS = "/diagnostics"
ACKNOWLEDGE = "/urdyn/acknowledge"  # std_msgs/String: the name of a status, or "" for all now

# Topic -> its type.
TOPICS = {
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
    "/urdyn/estimates": "control_msgs/msg/DynamicJointState",
    "/urdyn/predicted_torque": "sensor_msgs/msg/JointState",
    "/urdyn/residual_torque": "sensor_msgs/msg/JointState",
    "/urdyn/payload": "geometry_msgs/msg/InertiaStamped",
    "/urdyn/feed_forward": "std_msgs/msg/Float64MultiArray",
    "/urdyn/friction_scales": "std_msgs/msg/Float64MultiArray",
}

WARNED = (Level.WARN, Level.ERROR)
NUMBERS = re.compile(r",|\b\d")  # from here on a message changes with every sample

Publish = Callable[[str, Any], None]  # topic, message


@dataclass(frozen=True)
class Voice:
    """How messages are made and sent."""

    types: Types
    publish: Publish
    feed_forward: bool = False  # on request only: a controller may act on it
    friction_scales: bool = False  # likewise

    def quickly(self, torque: Array) -> None:
        """Publish at the motion's rate: torque (J,) [N·m] that a controller may add to its own."""
        if self.feed_forward:
            self.publish("/urdyn/feed_forward", self.types.numbers(torque))

    def steadily(self, now: Snapshot) -> None:
        """Publish the estimates."""
        types, stamp = self.types, now.stamp
        self.publish("/urdyn/estimates", types.estimates(stamp, _with_spread(now)))
        for name, torque in (("predicted", now.predicted), ("residual", now.residual)):
            self.publish(f"/urdyn/{name}_torque", types.efforts(stamp, now.joints, torque))
        mass = now.mean["payload"]["mass"]
        self.publish("/urdyn/payload", types.payload(stamp, mass, now.com))
        if self.friction_scales:
            self.publish("/urdyn/friction_scales", types.numbers(now.scales.ravel()))

    def diagnose(self, ns: int, statuses: tuple[Status, ...]) -> None:
        """Publish the arm's health, once a second; `ns` [ns] is now, when that state holds."""
        self.publish(DIAGNOSTICS, self.types.diagnostics(ns, statuses))


@dataclass(frozen=True)
class Seen:
    """A line as it was when somebody acknowledged it."""

    level: Level
    matters: frozenset[str]


def seen(statuses: Sequence[Status], names: Iterable[str]) -> dict[str, Seen]:
    """The current warnings of the statuses with these names, "" for all, by name."""
    asked, matters = set(names), _matters(statuses)
    return {
        s.name: Seen(s.level, matters[s.name])
        for s in statuses
        if s.level in WARNED and not asked.isdisjoint(("", s.name))
    }


def acknowledged(statuses: Sequence[Status], known: Mapping[str, Seen]) -> tuple[Status, ...]:
    """The statuses; what was acknowledged is shown, but no longer warned of.

    This ends when it gets worse, or something else is the matter too. The last line is the arm's,
    and names a warning that is left.
    """
    matters = _matters(statuses)

    def quiet(s: Status) -> bool:
        then = known.get(s.name)
        return then is not None and s.level <= then.level and matters[s.name] <= then.matters

    *parts, arm = [s.seen() if s.level in WARNED and quiet(s) else s for s in statuses]
    loud = [f"{s.name}: {s.message}" for s in parts if s.level == arm.level in WARNED]
    if loud and arm.message not in loud:  # what it names was acknowledged
        arm = replace(arm, message=loud[0])
    return (*parts, arm)


def forgetting(known: Mapping[str, Seen], statuses: Sequence[Status]) -> dict[str, Seen]:
    """What was acknowledged, without what is gone by now: it is warned of anew if it returns."""
    gone = [s.name for s in statuses if s.level == Level.OK and ("gone", "true") in s.values]
    of_these = tuple(f"{name}: " for name in gone)  # among the arm's
    return {
        name: replace(
            then, matters=frozenset(m for m in then.matters if not m.startswith(of_these))
        )
        for name, then in known.items()
        if name not in gone
    }


def _matters(statuses: Sequence[Status]) -> dict[str, frozenset[str]]:
    """What is the matter, by the statuses' names; the last one, the arm's, has that of all."""
    *parts, arm = [(s.name, _own(s)) for s in statuses]
    all_of = {f"{name}: {matter}" for name, matters in parts for matter in matters}
    return {**dict(parts), arm[0]: arm[1] | all_of}


def _own(status: Status) -> frozenset[str]:
    """Findings by their names, and what the message says before its numbers."""
    if status.level not in WARNED:
        return frozenset()
    found = (value.replace("_", " ") for key, value in status.values if key in ("id", "kind"))
    return frozenset((*found, NUMBERS.split(status.message)[0].strip()))


def dds_types() -> Types:
    """Message classes of DDS."""
    from urdyn.io.ros2 import idl

    classes = [
        c for c in vars(idl).values() if isinstance(c, type) and c.__module__ == idl.__name__
    ]
    named = {ros_name(c): c for c in classes}
    return Types(named.__getitem__, int)


def dds_publish(at: Any) -> Publish:
    """Writers to all our topics."""
    types = dds_types()
    writers = {topic: writer(at, topic, types.of(name)) for topic, name in TOPICS.items()}
    return lambda topic, message: writers[topic].write(message)


def dds_acknowledgements(at: Any) -> Callable[[], Iterator[str]]:
    """What has been acknowledged since the last look."""
    from urdyn.io.ros2 import idl

    source = reader(at, ACKNOWLEDGE, idl.String)
    return lambda: (m.data for m in source.take(N=100) if isinstance(m, idl.String))


def _with_spread(now: Snapshot) -> dict[str, dict[str, float]]:
    """Part -> quantity -> value, every quantity followed by its sd."""
    return {
        part: {
            name: number
            for quantity, value in values.items()
            for name, number in ((quantity, value), (f"{quantity}.sd", now.sd[part][quantity]))
        }
        for part, values in now.mean.items()
    }
