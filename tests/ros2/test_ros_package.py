"""The ROS 2 package: its files agree with one another; with ROS 2 sourced, the node works."""

from __future__ import annotations

import ast
import sys
import time
import xml.etree.ElementTree as ET
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from queue import Queue
from threading import Event
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
import yaml

from urdyn.io.bags.joints import JOINTS
from urdyn.io.ros2.listen import Understanding
from urdyn.io.ros2.talk import TOPICS
from urdyn.tracking.belief.physical import FRICTION, JOINT, PAYLOAD
from urdyn.tracking.output import announce

HERE = Path(__file__).parents[2] / "ros2" / "urdyn_ros"


def constant(file: str, name: str) -> object:
    """Value of a constant of a module that cannot be imported where ROS is not sourced."""
    for node in ast.parse((HERE / file).read_text()).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(t, ast.Name) and t.id == name for t in targets):
            return ast.literal_eval(node.value)
    raise KeyError(name)


def test_the_parameter_file_is_what_the_node_declares():
    file = yaml.safe_load((HERE / "config" / "urdyn.yaml").read_text())
    assert file["urdyn"]["ros__parameters"] == constant("urdyn_ros/node.py", "PARAMETERS")
    launched = constant("launch/urdyn.launch.py", "ARGUMENTS")
    assert launched.items() <= constant("urdyn_ros/node.py", "PARAMETERS").items()


def test_every_message_package_is_a_dependency():
    tree = ET.parse(HERE / "package.xml").getroot()
    wanted = {name.partition("/")[0] for name in TOPICS.values()} | {"std_srvs", "rclpy", "ur_msgs"}
    assert wanted <= {node.text for node in tree.findall("exec_depend")}
    assert tree.findtext("export/build_type") == "ament_python"
    assert (HERE / "resource" / tree.findtext("name")).is_file()


def test_what_a_controller_may_act_on_is_off_unless_asked_for():
    parameters = constant("urdyn_ros/node.py", "PARAMETERS")
    assert not any(parameters[name] for name in ("feed_forward", "friction_scales", "set_payload"))


class Node:
    """Of rclpy, what TwinNode asks of it; tells what was published, and sent to services."""

    def __init__(self, name):
        self.published, self.services, self.sent = {}, {}, []

    def declare_parameters(self, _, parameters):
        self.parameters = dict(parameters) | {"effort_unit": "A", "set_payload": True}

    def get_parameter(self, name):
        return SimpleNamespace(value=self.parameters[name])

    def create_publisher(self, _, topic, depth):
        return SimpleNamespace(publish=self.published.setdefault(topic, []).append)

    def create_subscription(self, *_):
        pass

    def create_service(self, _, name, answer):
        self.services[name] = lambda: answer(None, SimpleNamespace())

    def create_client(self, *_):
        return SimpleNamespace(service_is_ready=lambda: True, call_async=self.sent.append)


@pytest.fixture
def node_alone(monkeypatch):
    """The node's module, with stand-ins for all that it has of ROS."""
    parts = "rclpy", "rclpy.executors", "rclpy.node", "rclpy.qos", "rosidl_runtime_py.utilities"
    said = {"Vector3": SimpleNamespace, "SetPayload": SimpleNamespace(Request=SimpleNamespace)}
    for name in (*parts, "sensor_msgs.msg", "std_srvs.srv", "geometry_msgs.msg", "ur_msgs.srv"):
        for part in (name, name.partition(".")[0]):
            monkeypatch.setitem(sys.modules, part, MagicMock(Node=Node, **said))
    sys.modules["rosidl_runtime_py.utilities"].get_message = lambda _: SimpleNamespace
    sys.modules["rclpy.executors"].ExternalShutdownException = KeyError
    spec = spec_from_file_location("node", HERE / "urdyn_ros" / "node.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_two_arms_on_a_topic_end_the_node_in_a_line(node_alone, monkeypatch):
    names = [f"{side}_{joint}" for side in ("left", "right") for joint in JOINTS]
    hear = Understanding("joint_states")
    ended = Event()
    monkeypatch.setattr(node_alone, "TwinNode", lambda: MagicMock(ended=ended))
    monkeypatch.setattr(node_alone, "follow", lambda _: ended.wait(60.0))
    monkeypatch.setattr(
        node_alone.rclpy, "spin", lambda _: hear(SimpleNamespace(name=names), 0.0, False)
    )
    with pytest.raises(SystemExit, match=r"^urdyn: joint_states: has the joints of several arms"):
        node_alone.main()


@pytest.mark.parametrize(("carried", "asked"), [(-0.04, 0.0), (2.0, 2.0)])
def test_the_node_diagnoses_and_asks_for_what_a_controller_takes(
    node_alone, identified, monkeypatch, carried, asked
):
    """What follows its arm is a stand-in; who is told of it is the node's own."""
    monkeypatch.setattr(announce, "PULSE", 0.01)
    monkeypatch.setattr(node_alone, "PARAMETERS", node_alone.PARAMETERS | {"twin": __file__})
    for name in ("hearing", "Tracker", "Onlooker"):
        monkeypatch.setattr(node_alone, name, MagicMock())
    monkeypatch.setattr(node_alone.ud.Twin, "load", lambda _: SimpleNamespace(fit=identified))
    node = node_alone.TwinNode()
    joints = [f"{joint}.{name}" for joint in JOINTS for name, _ in (*JOINT.values(), FRICTION)]
    moments = dict.fromkeys(joints, 1.0) | dict.fromkeys((f"payload.{p}" for p in PAYLOAD), 0.1)
    moments["payload.mass"] = carried
    mean, nothing = np.array([*moments.values()]), np.zeros(6)
    reading = SimpleNamespace(modelled=nothing, predicted=nothing, current=nothing)
    now = SimpleNamespace(
        row=True, last=1.0, samples=1, findings=(), doubt="", ended=False, reading=reading,
        delay=0.0, behind="",
        names=[*moments], units=["-"] * len(mean), mean=mean, sd=np.full(len(mean), 0.05),
    )  # fmt: skip
    before = node.services["~/set_payload"]()
    assert not before.success and not node.sent  # nothing is weighed yet

    def run(*_, watch, observer):
        watch(now)
        deadline = time.monotonic() + 60
        while not np.isfinite(node.carried.load).all() and time.monotonic() < deadline:
            time.sleep(0.01)

    monkeypatch.setattr(node_alone, "run", run)
    node_alone.follow(node)
    assert node.published["/diagnostics"][0].status[-1].name == "urdyn: arm"
    assert node.services["~/set_payload"]().success
    (sent,) = node.sent
    assert sent.mass == asked
    assert np.isfinite([*vars(sent.center_of_gravity).values()]).all()


def test_the_node_hears_and_tells(tmp_path):
    rclpy = pytest.importorskip("rclpy", reason="ROS 2 is not sourced")
    sys.path.insert(0, str(HERE))
    from sensor_msgs.msg import JointState
    from urdyn_ros.node import TwinNode

    rclpy.init(args=["--ros-args", "-p", "effort_unit:=A", "-p", f"out:={tmp_path}"])
    node = TwinNode()
    other = rclpy.create_node("driver")
    out = other.create_publisher(JointState, "joint_states", 10)
    try:
        for k in range(100):
            message = JointState(
                name=list(JOINTS), position=[0.1] * 6, velocity=[0.0] * 6, effort=[1.0] * 6
            )
            message.header.stamp.nanosec = k * 2_000_000
            out.publish(message)
            rclpy.spin_once(node, timeout_sec=0.05)
        heard = node.inbox.qsize()
        assert heard > 50 and not list(node.remarks())
        node.inbox = Queue(1)
        for _ in range(3):
            node._hear(message)
        (line,) = node.remarks()
        assert "2 joint states lost" in line.message and not list(node.remarks())
    finally:
        node.destroy_node()
        other.destroy_node()
        rclpy.shutdown()
