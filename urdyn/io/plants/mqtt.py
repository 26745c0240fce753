"""Retained JSON on an MQTT broker, at least once: urdyn/SERIAL/joint/NAME, .../payload, .../status.

A lost broker is reconnected to; a later subscriber gets the newest state at once. When we go, the
broker publishes urdyn/SERIAL/online: false. In NAME, `#`, `+`, `/` and `%` are percent-encoded.
URDYN_MQTT_USER and URDYN_MQTT_PASSWORD hold our credentials; port 8883 uses TLS.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from queue import Empty, Queue
from typing import Any

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.address import joined, parse
from urdyn.io.plain import plain
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Status

PORT, SECURE = 1883, 8883  # as IANA assigns them; the second over TLS
USER, PASSWORD = "URDYN_MQTT_USER", "URDYN_MQTT_PASSWORD"  # environment variables
STRANGER = (134, 135)  # MQTT reason codes: bad user name or password, not authorized
AT_LEAST_ONCE = 1
RESERVED = "#+/\0"  # characters that a level of a topic cannot have
ENCODED = {ord(sign): f"%{ord(sign):02X}" for sign in (*RESERVED, "%")}
PATIENCE = 10.0  # [s] for a broker's first answer
WAIT = 2.0  # [s] for the last messages to arrive


@dataclass(frozen=True, eq=False)
class Broker:
    """A broker that keeps an arm's newest state: a `Listener`."""

    client: Any  # paho's
    robot: str

    def tell(self, now: Snapshot, statuses: Sequence[Status]) -> None:
        """Publish the statuses, every joint and the payload; nothing while the broker is away.

        The client would queue them all, and send the broker the past before the present.
        """
        if not self.client.is_connected():
            return
        lines = {s.name.removeprefix("urdyn: "): [s.level.name, s.message] for s in statuses}
        self.publish("status", {"stamp_s": now.stamp / 1e9, "parts": lines})
        for joint in now.joints:
            self.publish(f"joint/{joint.translate(ENCODED)}", _part(now, joint))
        self.publish("payload", _part(now, "payload"))
        self.publish("online", True)  # another of this name may have gone meanwhile

    def close(self) -> None:
        """Publish that we go, if the broker is there, and go."""
        with suppress(RuntimeError, ValueError):  # the broker is away
            self.publish("online", False).wait_for_publish(WAIT)
        self.leave()

    def publish(self, where: str, document: Any) -> Any:
        """A document under the robot's name, which the broker keeps."""
        text = json.dumps(document)
        return self.client.publish(f"urdyn/{self.robot}/{where}", text, AT_LEAST_ONCE, retain=True)

    def leave(self) -> None:
        """Hang up."""
        self.client.disconnect()
        self.client.loop_stop()


def connect(text: str, robot: str) -> Broker:
    """Connect to HOST[:PORT].

    Raises:
        InputError: no broker answers there, or it refuses us; no topic can have the robot's name.
    """
    if taken := [sign for sign in RESERVED if sign in robot]:
        told = f"no topic can be named after {robot!r}, for it has {taken[0]!r}"
        raise InputError(f"MQTT: {told}; say another --serial")
    if find_spec("paho") is None:
        raise MissingExtraError("plants", "paho-mqtt")
    host, port = parse(text, PORT, "MQTT broker")
    broker = Broker(_client(robot), robot)
    answers = _answers(broker)
    try:
        if port == SECURE:
            broker.client.tls_set()
        broker.client.connect(host, port)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"MQTT broker {joined(host, port)}: {reason}") from error
    broker.client.loop_start()
    try:
        refused = answers.get(timeout=PATIENCE)
    except Empty:
        refused = "does not answer as a broker does"
    if refused:
        broker.leave()
        raise InputError(f"MQTT broker {joined(host, port)}: {refused}")
    return broker


def _client(robot: str) -> Any:
    """Our client, with credentials and what the broker is to publish when we are gone."""
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    client = Client(CallbackAPIVersion.VERSION2)
    client.will_set(f"urdyn/{robot}/online", "false", AT_LEAST_ONCE, retain=True)
    if user := os.environ.get(USER):
        client.username_pw_set(user, os.environ.get(PASSWORD))
    return client


def _answers(broker: Broker) -> Queue[str]:
    """The broker's answer to every connection: "", or why it refuses us."""
    answers: Queue[str] = Queue()

    def answered(_client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        """Called after every reconnect, too."""
        if not reason.is_failure:
            broker.publish("online", True)
        hint = f"; {USER} and {PASSWORD} say who we are" if reason.value in STRANGER else ""
        answers.put(f"{reason}{hint}" if reason.is_failure else "")

    broker.client.on_connect = answered
    return answers


def _part(now: Snapshot, part: str) -> dict[str, Any]:
    """Quantity -> mean and sd; None where not finite."""
    told: dict[str, Any] = {
        name: {"mean": plain(value), "sd": plain(now.sd[part][name])}
        for name, value in now.mean[part].items()
    }
    return {"stamp_s": now.stamp / 1e9, **told}
