"""A place in a ROS 2 graph without a ROS installation: its names, types and qualities of service.

A topic `/joint_states` is `rt/joint_states` in DDS, its type `sensor_msgs::msg::dds_::JointState_`,
and endpoints carry the hash of the type in their user data. ROS_DOMAIN_ID, CYCLONEDDS_URI and what
`discovery` reads mean what they mean to ROS.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from typing import Any

from urdyn.errors import InputError
from urdyn.io.bags.forms import require
from urdyn.io.ros2.discovery import configurations

URI = "CYCLONEDDS_URI"
DEEP = 4000  # samples that wait for us, at most: eight seconds of 500 Hz
KEPT = 10  # samples that wait for our listeners, ROS's default
PATIENCE = 100  # [ms] that a writer waits for a listener whose queue is full
# Not among the types that rosbags knows.
DEFINITIONS = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "control_msgs/InterfaceValue[] interface_values\n"
    ),
}


def participant(environ: Mapping[str, str] = os.environ) -> Any:
    """Our entry into the graph."""
    require("cyclonedds", "rosbags")
    number, asked = _number(environ.get("ROS_DOMAIN_ID") or "0"), environ.get(URI, "")
    from cyclonedds.core import DDSException
    from cyclonedds.domain import DomainParticipant

    failed = Exception()
    for configuration in configurations(environ):
        # Cyclone reads it when the domain is made; the last setting, the user's, wins.
        os.environ[URI] = ",".join(filter(None, (configuration, asked)))
        try:
            return DomainParticipant(number)
        except DDSException as error:
            failed = error
        finally:
            del os.environ[URI]
            if asked:
                os.environ[URI] = asked
    raise InputError(f"ROS_DOMAIN_ID {number}: no place in this network: {failed}") from failed


def _number(text: str) -> int:
    if not text.isdecimal() or int(text) > 232:
        raise InputError(f"ROS_DOMAIN_ID {text!r}: is to be a number from 0 to 232")
    return int(text)


def ros_name(type_: Any) -> str:
    """`sensor_msgs/msg/JointState` of a message class."""
    package, kind, _, name = str(type_.__idl_typename__).split("::")
    return f"{package}/{kind}/{name.rstrip('_')}"


@cache
def type_hash(name: str) -> str:
    """RIHS01 hash of a message type."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for missing, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, missing))
    return str(store.hash_rihs01(name))


def reader(at: Any, topic: str, type_: Any) -> Any:
    """A reader of a ROS topic, with sensor data's quality of service: it matches any publisher."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.sub import DataReader

    qos = Qos(
        Policy.Reliability.BestEffort, Policy.History.KeepLast(DEEP), *_always(ros_name(type_))
    )
    return DataReader(at, _topic(at, topic, type_), qos=qos)


def writer(at: Any, topic: str, type_: Any) -> Any:
    """A writer to a ROS topic, reliable, as is ROS's default."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.pub import DataWriter
    from cyclonedds.util import duration

    reliable = Policy.Reliability.Reliable(duration(milliseconds=PATIENCE))
    qos = Qos(reliable, Policy.History.KeepLast(KEPT), *_always(ros_name(type_)))
    return DataWriter(at, _topic(at, topic, type_), qos=qos)


def _always(name: str) -> tuple[Any, ...]:
    from cyclonedds.core import Policy

    return (
        Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True),  # as ROS writes and reads
        Policy.Userdata(f"typehash={type_hash(name)};".encode()),
    )


def _topic(at: Any, name: str, type_: Any) -> Any:
    from cyclonedds.topic import Topic

    return Topic(at, f"rt/{name.lstrip('/')}", type_)
