"""ROS messages as DDS carries them: names, fields and order are those of the .msg files.

`cyclonedds` is imported with this module, and this module only where DDS is spoken. No postponed
annotations here: the serialiser reads them.
"""
# ruff: noqa: D101

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import byte, float64, int32, sequence, uint8, uint32


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
@final
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
@final
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
@final
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
@final
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
@final
class InterfaceValue(IdlStruct, typename="control_msgs::msg::dds_::InterfaceValue_"):
    interface_names: sequence[str]
    values: sequence[float64]


@dataclass
@final
class DynamicJointState(IdlStruct, typename="control_msgs::msg::dds_::DynamicJointState_"):
    header: Header
    joint_names: sequence[str]
    interface_values: sequence[InterfaceValue]


@dataclass
@final
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
@final
class Inertia(IdlStruct, typename="geometry_msgs::msg::dds_::Inertia_"):
    m: float64
    com: Vector3
    ixx: float64
    ixy: float64
    ixz: float64
    iyy: float64
    iyz: float64
    izz: float64


@dataclass
@final
class InertiaStamped(IdlStruct, typename="geometry_msgs::msg::dds_::InertiaStamped_"):
    header: Header
    inertia: Inertia


@dataclass
@final
class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
@final
class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension]
    data_offset: uint32


@dataclass
@final
class Float64MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float64MultiArray_"):
    layout: MultiArrayLayout
    data: sequence[float64]


@dataclass
@final
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
@final
class Empty(IdlStruct, typename="std_msgs::msg::dds_::Empty_"):
    structure_needs_at_least_one_member: uint8
