"""Over DDS we are what a ROS 2 node is: names, types, hashes, qualities of service; none lost."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from queue import Empty

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.bags import forms
from urdyn.io.ros2 import idl
from urdyn.io.ros2.discovery import configurations
from urdyn.io.ros2.domain import participant, reader, ros_name, type_hash, writer
from urdyn.io.ros2.listen import RESET, Listener
from urdyn.io.ros2.talk import TOPICS, dds_publish, dds_types

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
GRID = 0.002  # [s]


def heard(topic: str, seconds: float, wanted: int) -> list:
    """What comes within so long, or so much of it."""
    listener, came = Listener(participant(), topic), []
    end = time.monotonic() + seconds
    while len(came) < wanted and (left := end - time.monotonic()) > 0.0:
        with suppress(Empty):
            came.append(listener.get(left))
    return came


def test_every_joint_state_is_heard_in_order_base_first(publish, domain):
    publish(1000, "-")
    came = heard("joint_states", 60.0, 1000)
    stamps = np.array([one.stamp for one in came])
    assert len(came) == 1000
    # Seconds since 1970 are told to 2.4e-7.
    np.testing.assert_allclose(np.diff(stamps), GRID, atol=1e-6)
    for one in came[:: len(came) // 5]:
        np.testing.assert_array_equal(one.q, np.arange(6.0) / 7)
        np.testing.assert_array_equal(one.effort, np.arange(6.0) / 7)


# What nodes tell Cyclone themselves when they are to stay on this computer.
COUNTED = (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
    '</MaxAutoParticipantIndex><Peers><Peer address="localhost"/></Peers></Discovery>'
)
SILENT = "<AllowMulticast>false</AllowMulticast>"
ON_LOOPBACK = '<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
NODES = {"Humble": ON_LOOPBACK, "Iron and later": SILENT}
STAYING = {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


# Each with the variable of its own time; who mixes them is heard as well.
OWN = tuple(zip(NODES, STAYING, strict=True))
MIXED = tuple(zip(NODES, reversed(STAYING), strict=True))


@pytest.mark.parametrize(
    ("node", "variable"), [*OWN, *(pytest.param(*of, marks=pytest.mark.slow) for of in MIXED)]
)
def test_nodes_that_stay_on_this_computer_are_heard(publish, domain, monkeypatch, node, variable):
    """Though they were there before us, and call nobody again for half a minute."""
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "")
    general = f"<General>{NODES[node]}</General>"
    monkeypatch.setenv(
        "CYCLONEDDS_URI", f"<CycloneDDS><Domain>{general}{COUNTED}</Domain></CycloneDDS>"
    )
    publish(2000, "-", 60)
    monkeypatch.setenv("CYCLONEDDS_URI", "")
    monkeypatch.setenv(variable, STAYING[variable])
    time.sleep(3.0)  # until it has called
    assert len(heard("joint_states", 15.0, 100)) == 100


def test_a_range_that_ros_does_not_know_is_told(domain, monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "NEAR")
    with pytest.raises(InputError, match="SUBNET, LOCALHOST, OFF"):
        participant()


def test_how_far_to_look_is_what_the_variables_say():
    [anywhere] = configurations({})
    assert anywhere == ""
    assert configurations({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}) == ("",)
    [called] = configurations({"ROS_STATIC_PEERS": '10.0.0.7;cell"3'})
    assert '<Peer Address="10.0.0.7"/><Peer Address=\'cell"3\'/>' in called
    [off] = configurations({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "10.0.0.7"})
    assert "Peer" not in off and "ros_discovery_off_" in off
    for here in configurations({"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.0.0.7"}):
        assert "10.0.0.7" not in here and "localhost" in here


@pytest.mark.parametrize("asked", [None, "<CycloneDDS/>"])
def test_the_environment_is_left_as_it_was(asked, domain, monkeypatch):
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    if asked:
        monkeypatch.setenv("CYCLONEDDS_URI", asked)
    participant()
    assert os.environ.get("CYCLONEDDS_URI") == asked


def test_endpoints_carry_ros_names_types_and_hashes(domain):
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
    from cyclonedds.core import Policy

    at = participant()
    held = [writer(at, "/joint_states", idl.JointState), dds_publish(at)]
    time.sleep(0.3)
    told = list(BuiltinDataReader(at, BuiltinTopicDcpsPublication).take(N=100))
    found = {one.topic_name: one for one in told if hasattr(one, "topic_name")}
    joints = found["rt/joint_states"]
    assert joints.type_name == "sensor_msgs::msg::dds_::JointState_"
    user = joints.qos[Policy.Userdata].data
    # As `ros2 topic info --verbose` tells it of any installation since Iron.
    known = b"RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    assert user == b"typehash=" + known + b";"
    assert {f"rt{topic}" for topic in TOPICS} <= set(found)
    assert found["rt/diagnostics"].type_name == "diagnostic_msgs::msg::dds_::DiagnosticArray_"
    assert found["rt/diagnostics"].qos[Policy.Reliability] != Policy.Reliability.BestEffort
    assert held


def test_sensor_data_is_asked_for(domain):
    from cyclonedds.core import Policy

    at = participant()
    qos = reader(at, "/joint_states", idl.JointState).get_qos()
    assert qos[Policy.Reliability] == Policy.Reliability.BestEffort
    assert qos[Policy.Durability] == Policy.Durability.Volatile


@pytest.mark.parametrize("name", sorted(set(TOPICS.values())))
def test_fields_are_those_of_the_message_files(name):
    """What rosbags writes of a type, DDS reads as the same type, and the other way."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from urdyn.io.ros2.domain import DEFINITIONS

    store = get_typestore(Stores.ROS2_HUMBLE)
    for missing, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, missing))
    for one in vars(idl).values():
        if isinstance(one, type) and one.__module__ == idl.__name__:
            fields = [field for field, _ in store.fielddefs[ros_name(one)][1]] or [
                "structure_needs_at_least_one_member"
            ]
            assert list(one.__dataclass_fields__) == fields, one
    assert dds_types().of(name) and type_hash(name).startswith("RIHS01_")


def test_a_diagnosis_is_the_same_bytes_as_any_other_library_s():
    from urdyn.io.bags.outgoing import typestore
    from urdyn.io.ros2.compose import Types
    from urdyn.io.status import Level, Status

    lines = (Status(Level.WARN, "urdyn: elbow_joint", "rust", (("f", "3.1"),), "20235"),)
    name, store = "diagnostic_msgs/msg/DiagnosticArray", typestore()
    other = store.serialize_cdr(Types(store.types.__getitem__, int).diagnostics(5, lines), name)
    ours = dds_types().diagnostics(5, lines).serialize(use_version_2=False)
    assert bytes(ours).rstrip(b"\0") == bytes(other).rstrip(b"\0")


def test_a_reset_is_heard_with_the_next_sample(publish, domain):
    publish(3000, "-")
    at, came = participant(), [False]
    listener, out = Listener(at, "joint_states"), writer(at, RESET, idl.Empty)
    while not came[-1] and len(came) < 3000:
        came.append(listener.get(25.0).reset)
        if len(came) == 100:
            out.write(idl.Empty(0))
    assert came[-1] and not any(came[:-1]) and len(came) < 3000


def test_what_keeps_us_out_of_a_graph_is_one_line(domain, monkeypatch):
    with pytest.raises(InputError, match="from 0 to 232"):
        participant({"ROS_DOMAIN_ID": "many"})
    monkeypatch.setattr(forms, "find_spec", lambda package: None)
    with pytest.raises(MissingExtraError, match=r"\.\[ros2\]"):
        participant({})
