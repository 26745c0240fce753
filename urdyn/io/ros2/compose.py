"""What we publish, as messages of either ROS library: DDS here, rclpy in the node."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from urdyn.io.status import Status
from urdyn.types import Array

Values = Mapping[str, float]


@dataclass(frozen=True)
class Types:
    """Message classes by name, and how this library writes a byte."""

    of: Callable[[str], Any]  # "std_msgs/msg/Header" -> its class
    byte: Callable[[int], Any]

    def header(self, ns: int) -> Any:
        """A header at `ns` [ns] since 1970, or since whatever the robot counts from."""
        stamp = self.of("builtin_interfaces/msg/Time")(sec=ns // 10**9, nanosec=ns % 10**9)
        return self.of("std_msgs/msg/Header")(stamp=stamp, frame_id="")

    def diagnostics(self, ns: int, statuses: Sequence[Status]) -> Any:
        """diagnostic_msgs/DiagnosticArray."""
        return self.of("diagnostic_msgs/msg/DiagnosticArray")(
            header=self.header(ns), status=[self._status(status) for status in statuses]
        )

    def _status(self, status: Status) -> Any:
        pair = self.of("diagnostic_msgs/msg/KeyValue")
        return self.of("diagnostic_msgs/msg/DiagnosticStatus")(
            level=self.byte(status.level),
            name=status.name,
            message=status.message,
            hardware_id=status.hardware_id,
            values=[pair(key=key, value=value) for key, value in status.values],
        )

    def estimates(self, ns: int, parts: Mapping[str, Values]) -> Any:
        """control_msgs/DynamicJointState: joint or link -> quantity -> value, SI."""
        value = self.of("control_msgs/msg/InterfaceValue")
        told = [value(interface_names=list(v), values=list(v.values())) for v in parts.values()]
        return self.of("control_msgs/msg/DynamicJointState")(
            header=self.header(ns), joint_names=list(parts), interface_values=told
        )

    def efforts(self, ns: int, joints: Sequence[str], torque: Array) -> Any:
        """sensor_msgs/JointState with efforts only [N·m]."""
        return self.of("sensor_msgs/msg/JointState")(
            header=self.header(ns),
            name=list(joints),
            position=[],
            velocity=[],
            effort=torque.tolist(),
        )

    def payload(self, ns: int, mass: float, com: Array) -> Any:
        """geometry_msgs/InertiaStamped: mass [kg] and centre [m]; a point mass."""
        vector = self.of("geometry_msgs/msg/Vector3")
        x, y, z = com.tolist()
        inertia = self.of("geometry_msgs/msg/Inertia")(
            m=mass,
            com=vector(x=x, y=y, z=z),
            **dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 0.0),
        )
        return self.of("geometry_msgs/msg/InertiaStamped")(header=self.header(ns), inertia=inertia)

    def numbers(self, values: Array) -> Any:
        """std_msgs/Float64MultiArray without a layout, as command topics of ros2_control take."""
        layout = self.of("std_msgs/msg/MultiArrayLayout")(dim=[], data_offset=0)
        return self.of("std_msgs/msg/Float64MultiArray")(layout=layout, data=values.tolist())
