"""Snapshots -> ROS 2 topics; the same for DDS and for the node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from urdyn.io.ros2.compose import Types
from urdyn.io.ros2.domain import reader, ros_name, writer
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Status
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
