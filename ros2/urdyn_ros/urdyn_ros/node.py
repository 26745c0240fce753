"""The node: rclpy carries the messages, urdyn does everything else."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import Empty, Full, Queue, SimpleQueue
from threading import Event, Thread
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

import urdyn as ud
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.onlooker import Onlooker
from urdyn.errors import UrdynError
from urdyn.estimate import UKF
from urdyn.io import sha256
from urdyn.io.ros2.compose import Types
from urdyn.io.ros2.listen import Heard, Understanding
from urdyn.io.ros2.talk import TOPICS, Voice
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Level, Status
from urdyn.tracking import Tracker, run
from urdyn.tracking.belief.payload_setting import settable
from urdyn.tracking.belief.physical import KNOWN, PAYLOAD
from urdyn.tracking.output.announce import Announcer, Audience
from urdyn.tracking.sources.ros2_source import hearing

PARAMETERS: dict[str, Any] = {
    "twin": "twin.toml",
    "out": "urdyn",
    "topic": "joint_states",
    "effort_unit": "",
    "rate": 0.0,
    "serial": "",
    "feed_forward": False,
    "friction_scales": False,
    "set_payload": False,
}
WAITING = 5000  # joint states that may wait: ten seconds at 500 Hz
SET_PAYLOAD = "/io_and_status_controller/set_payload"


class Carried:
    """What is carried, for whoever asks: a `Listener`."""

    def __init__(self) -> None:
        self.load = np.full(len(PAYLOAD), np.nan)  # mass [kg] and first moments [kg·m]
        self.sd = float("inf")  # [kg] of its mass

    def tell(self, now: Snapshot, _: Sequence[Status]) -> None:
        """What is believed now, and how sure that is."""
        self.load = np.array([now.mean["payload"][name] for name in PAYLOAD])
        self.sd = now.sd["payload"]["mass"]

    def close(self) -> None:
        """It is known as it was."""


class TwinNode(Node):
    """Joint states in; diagnostics, estimates and torques out."""

    def __init__(self) -> None:
        super().__init__("urdyn")
        self.declare_parameters("", list(PARAMETERS.items()))
        self.ended, self.told = Event(), SimpleQueue()
        self.inbox: Queue[Heard] = Queue(WAITING)
        self._lost = self._lost_before = 0  # joint states for which there was no room
        self._reset = False
        self._understand = Understanding(self.asked("topic"))
        self.carried = Carried()
        publishers = {
            topic: self.create_publisher(get_message(name), topic, 10)
            for topic, name in TOPICS.items()
        }

        types = Types(get_message, lambda level: bytes([level]))
        wanted = {name: self.asked(name) for name in ("feed_forward", "friction_scales")}
        self.voice = Voice(types, lambda topic, one: publishers[topic].publish(one), **wanted)
        self.create_subscription(
            JointState, self.asked("topic"), self._hear, qos_profile_sensor_data
        )
        self.create_service(Trigger, "~/acknowledge", self._acknowledge)
        self.create_service(Trigger, "~/reset", self._begin_anew)
        if self.asked("set_payload"):
            self._offer_payload()

    def asked(self, name: str) -> Any:
        """A parameter's value."""
        return self.get_parameter(name).value

    def acknowledgements(self) -> Iterator[str]:
        """What has been acknowledged since the last look."""
        while True:
            try:
                yield self.told.get_nowait()
            except Empty:
                return

    def remarks(self) -> Iterator[Status]:
        """Whether joint states were lost since the last look."""
        lost, self._lost_before = self._lost - self._lost_before, self._lost
        if lost:
            told = f"falls behind: {lost} joint states lost, {self._lost} in all"
            yield Status(Level.WARN, "urdyn: node", told, (), self.asked("serial"))

    def _hear(self, message: JointState) -> None:
        heard = self._understand(message, time.monotonic(), self._reset)
        if heard is None:
            return
        try:
            self.inbox.put_nowait(heard)
        except Full:
            self._lost += 1
        else:
            self._reset = False

    def _acknowledge(self, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        self.told.put("")
        answer.success, answer.message = True, "all that is warned of is acknowledged"
        return answer

    def _begin_anew(self, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        self._reset = True
        answer.success, answer.message = True, "begun anew with the commissioned arm"
        return answer

    def _offer_payload(self) -> None:
        from geometry_msgs.msg import Vector3
        from ur_msgs.srv import SetPayload

        client = self.create_client(SetPayload, SET_PAYLOAD)

        def tell(_: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
            if self.carried.sd > KNOWN or not client.service_is_ready():
                answer.success, answer.message = False, f"nothing weighed, or no {SET_PAYLOAD}"
                return answer
            mass, com = settable(self.carried.load)
            centre = Vector3(**dict(zip("xyz", com.tolist(), strict=True)))
            client.call_async(SetPayload.Request(mass=mass, center_of_gravity=centre))
            answer.success, answer.message = True, f"{mass:.3f} kg asked for"
            return answer

        self.create_service(Trigger, "~/set_payload", tell)


def follow(node: TwinNode) -> None:
    """Track until the node ends."""
    twin = Path(node.asked("twin"))
    twin_sha256, fit = sha256(twin), ud.Twin.load(twin).fit
    effort = ud.Effort(node.asked("effort_unit") or None, fit.dynamics.drive.gain)
    effort.told(node.asked("topic"))
    audience = Audience(node.voice, (node.carried,), node.acknowledgements, node.remarks)
    announcer = Announcer(fit, audience, node.asked("serial"))
    try:
        source = hearing(
            f"ros2://{node.asked('topic')}",
            node.inbox,
            node.ended,
            effort,
            node.asked("rate") or None,
        )
        tracker = Tracker(fit, UKF(), source.period, velocities=source.velocities)
        origin = {"source": source.name, "source.sha256": source.sha256}
        diagnosis = Onlooker(fit, source.period, read_rules(), origin, live=True)
        out = Path(node.asked("out"))
        run(tracker, source, out, twin_sha256, watch=announcer.watch, observer=diagnosis)
    finally:
        announcer.close()


def main() -> None:
    """ros2 run urdyn_ros twin --ros-args -p twin:=twin.toml -p effort_unit:=A"""
    rclpy.init()
    node = TwinNode()
    failure: list[BaseException] = []

    def work() -> None:
        try:
            follow(node)
        except BaseException as error:
            failure.append(error)
            rclpy.try_shutdown()

    worker = Thread(target=work)
    worker.start()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except UrdynError as error:  # of a message that cannot be understood
        failure.append(error)
    finally:
        node.ended.set()
        worker.join()
        node.destroy_node()
        rclpy.try_shutdown()
    if failure:
        raise SystemExit(f"urdyn: {failure[0]}")
