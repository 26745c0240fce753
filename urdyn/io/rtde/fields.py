"""Every variable that a controller sends or takes, with its type and its first release.

Names, types, units and releases are those of UR's RTDE guide, "Field names and associated types".
Three families answer on port 30004: CB3 (3.x), e-Series (5.x) and PolyScope X (10.x).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

Release = tuple[int, ...]  # major, minor, ...

# Type -> its number in a package as NumPy writes it, and how many of them; network byte order.
TYPES: Mapping[str, tuple[str, int]] = {
    "BOOL": ("u1", 1),  # 0 is false, everything else is true
    "UINT8": ("u1", 1),
    "UINT32": (">u4", 1),
    "UINT64": (">u8", 1),
    "INT32": (">i4", 1),
    "DOUBLE": (">f8", 1),
    "VECTOR3D": (">f8", 3),
    "VECTOR6D": (">f8", 6),
    "VECTOR6INT32": (">i4", 6),
    "VECTOR6UINT32": (">u4", 6),
}
NOT_FOUND = "NOT_FOUND"  # in place of a type: the controller does not know the name
IN_USE = "IN_USE"  # in place of a type: another client sets this input


@dataclass(frozen=True)
class Field:
    """A variable and the releases that know it: the first of each family."""

    name: str
    type: str
    since: tuple[Release, ...]

    def known(self, release: Release) -> bool:
        """Does a controller of this release know the variable?"""
        return any(first[0] == release[0] and release >= first for first in self.since)


FIRST: tuple[Release, ...] = ((3, 4), (5, 0), (10, 0))
UPPER: tuple[Release, ...] = ((3, 9), (5, 3), (10, 0))  # registers beyond those of field buses


def _fields(type_: str, names: str | Iterable[str], *since: Release) -> tuple[Field, ...]:
    """Fields of one type; `names` parted by blanks."""
    words = names.split() if isinstance(names, str) else names
    return tuple(Field(name, type_, since or FIRST) for name in words)


def _registers(way: str) -> tuple[Field, ...]:
    """General-purpose registers: 128 bits, 48 integers, 48 doubles."""
    numbers = [("int", "INT32"), ("double", "DOUBLE")]
    return (
        *_fields("UINT32", f"{way}_bit_registers0_to_31 {way}_bit_registers32_to_63"),
        *_fields("BOOL", (f"{way}_bit_register_{k}" for k in range(64, 128)), *UPPER),
        *(
            field
            for kind, type_ in numbers
            for low, high, since in ((0, 24, FIRST), (24, 48, UPPER))
            for field in _fields(
                type_, (f"{way}_{kind}_register_{k}" for k in range(low, high)), *since
            )
        ),
    )


_INPUTS = (
    *_fields("UINT32", "speed_slider_mask"),
    *_fields("DOUBLE", "speed_slider_fraction standard_analog_output_0 standard_analog_output_1"),
    *_fields("UINT8", "standard_digital_output_mask standard_digital_output"),
    *_fields("UINT8", "configurable_digital_output_mask configurable_digital_output"),
    *_fields("UINT8", "standard_analog_output_mask standard_analog_output_type"),
    *_fields("UINT8", "tool_digital_output_mask tool_digital_output"),  # answered, not in the guide
    *_fields("VECTOR6D", "external_force_torque"),
    *_registers("input"),
)

_OUTPUTS = (
    *_fields("DOUBLE", "timestamp actual_execution_time speed_scaling target_speed_fraction"),
    *_fields("VECTOR6D", "target_q target_qd target_qdd target_current target_moment"),
    *_fields("VECTOR6D", "actual_q actual_qd actual_current actual_current_window"),
    *_fields("VECTOR6D", "joint_control_output joint_temperatures actual_joint_voltage"),
    *_fields("VECTOR6D", "actual_TCP_pose actual_TCP_speed actual_TCP_force"),
    *_fields("VECTOR6D", "target_TCP_pose target_TCP_speed"),
    *_fields("UINT64", "actual_digital_input_bits actual_digital_output_bits"),
    *_fields("INT32", "robot_mode safety_mode tool_output_voltage"),
    *_fields("VECTOR6INT32", "joint_mode"),
    *_fields("VECTOR3D", "actual_tool_accelerometer"),
    *_fields("DOUBLE", "actual_momentum actual_main_voltage actual_robot_voltage"),
    *_fields("DOUBLE", "actual_robot_current io_current tcp_force_scalar"),
    *_fields("UINT32", "runtime_state robot_status_bits safety_status_bits analog_io_types"),
    *_fields("DOUBLE", "standard_analog_input0 standard_analog_input1"),
    *_fields("DOUBLE", "standard_analog_output0 standard_analog_output1"),
    *_fields("UINT32", "euromap67_input_bits euromap67_output_bits"),
    *_fields("DOUBLE", "euromap67_24V_voltage euromap67_24V_current"),
    *_fields("UINT32", "tool_mode tool_analog_input_types"),
    *_fields("DOUBLE", "tool_analog_input0 tool_analog_input1"),
    *_fields("DOUBLE", "tool_output_current tool_temperature"),
    *_fields("VECTOR3D", "elbow_position elbow_velocity", (3, 5), (5, 0), (10, 0)),
    *_fields("INT32", "safety_status", (3, 10), (5, 4), (10, 0)),
    *_fields("DOUBLE", "payload", (3, 11), (5, 5, 1), (10, 0)),
    *_fields("VECTOR3D", "payload_cog", (3, 11), (5, 5, 1), (10, 0)),
    *_fields("VECTOR6D", "payload_inertia", (3, 15), (5, 11), (10, 0)),
    *_fields("UINT32", "script_control_line", (3, 14), (5, 9), (10, 0)),
    *_fields("UINT8", "tool_output_mode", (5, 0), (10, 0)),
    *_fields("UINT8", "tool_digital_output0_mode tool_digital_output1_mode", (5, 0), (10, 0)),
    *_fields("VECTOR6D", "ft_raw_wrench", (5, 9), (10, 0)),
    *_fields("DOUBLE", "joint_position_deviation_ratio", (5, 13), (10, 0)),
    *_fields("DOUBLE", "collision_detection_ratio", (5, 15), (10, 0)),
    *_fields("INT32", "time_scale_source", (5, 17), (10, 0)),
    *_fields("VECTOR6D", "actual_current_as_torque", (5, 23), (10, 11)),
    *_fields("VECTOR6D", "tcp_offset wrench_calc_from_currents", (5, 23), (10, 11)),
    *_fields("DOUBLE", "actual_robot_energy_consumed", (5, 23), (10, 11)),
    *_fields("DOUBLE", "actual_robot_braking_energy_dissipated", (5, 23), (10, 11)),
    *_fields("INT32", "encoder0_raw encoder1_raw", (5, 23), (10, 11)),
    *_fields("VECTOR3D", "target_gravity", (5, 23), (10, 11)),
    *_fields("VECTOR6D", "target_base_acceleration", (5, 23), (10, 11)),
    *_registers("output"),
    *_registers("input"),  # read back
)


def cycle_rate(release: Release) -> float:
    """Control cycles a second [Hz]: 125 on CB3, 500 on what came after."""
    return 125.0 if release[0] < 5 else 500.0


def outputs(release: Release) -> dict[str, str]:
    """Name -> type of all that a controller of this release sends."""
    return {field.name: field.type for field in _OUTPUTS if field.known(release)}


def inputs(release: Release) -> dict[str, str]:
    """Name -> type of all that a controller of this release takes."""
    return {field.name: field.type for field in _INPUTS if field.known(release)}
