"""Retained JSON on an MQTT broker, at least once: urdyn/ROBOT/joint/NAME, .../payload, .../status.

A broker that goes away is taken up again; whoever asks later gets the newest state at once. When
we go, the broker tells urdyn/ROBOT/online: false. Who we are stands in URDYN_MQTT_USER and
URDYN_MQTT_PASSWORD; port 8883 is spoken to over TLS.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from queue import Empty, Queue
from typing import Any

from urdyn.errors import InputError, MissingExtraError
from urdyn.io.address import joined, parse
from urdyn.io.plain import plain
from urdyn.io.ros2.status import Status
from urdyn.io.snapshot import Snapshot

PORT, SECURE = 1883, 8883  # as IANA has them; the second over TLS
USER, PASSWORD = "URDYN_MQTT_USER", "URDYN_MQTT_PASSWORD"  # of the environment
AT_LEAST_ONCE = 1
PATIENCE = 10.0  # [s] for a broker's first word
WAIT = 2.0  # [s] for the last words to arrive

Tell = Callable[[Snapshot, Sequence[Status]], None]


def connect(text: str, robot: str) -> tuple[Tell, Callable[[], None]]:
    """Connect to HOST[:PORT]: what takes the newest snapshot, and what ends it."""
    if find_spec("paho") is None:
        raise MissingExtraError("plants", "paho-mqtt")
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    host, port = parse(text, PORT, "MQTT broker")
    client = Client(CallbackAPIVersion.VERSION2)
    client.will_set(f"urdyn/{robot}/online", "false", AT_LEAST_ONCE, retain=True)
    if user := os.environ.get(USER):
        client.username_pw_set(user, os.environ.get(PASSWORD))
    answers: Queue[str] = Queue()  # "", or why the broker refuses us

    def answered(_client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        """Said again after every reconnect."""
        if not reason.is_failure:
            _publish(client, f"urdyn/{robot}/online", True)
        answers.put(f"{reason}; {USER} and {PASSWORD} say who we are" if reason.is_failure else "")

    client.on_connect = answered
    try:
        if port == SECURE:
            client.tls_set()
        client.connect(host, port)
    except OSError as error:
        raise InputError(f"MQTT broker {joined(host, port)}: {error.strerror or error}") from error
    client.loop_start()
    try:
        refused = answers.get(timeout=PATIENCE)
    except Empty:
        refused = "does not answer as a broker does"
    if refused:
        client.disconnect()
        client.loop_stop()
        raise InputError(f"MQTT broker {joined(host, port)}: {refused}")

    def tell(now: Snapshot, statuses: Sequence[Status]) -> None:
        for part in (*now.joints, "payload"):
            where = "payload" if part == "payload" else f"joint/{part}"
            _publish(client, f"urdyn/{robot}/{where}", _part(now, part))
        lines = {s.name.removeprefix("urdyn: "): [s.level.name, s.message] for s in statuses}
        _publish(client, f"urdyn/{robot}/status", {"stamp_s": now.stamp / 1e9, "parts": lines})

    def close() -> None:
        _publish(client, f"urdyn/{robot}/online", False).wait_for_publish(WAIT)
        client.disconnect()
        client.loop_stop()

    return tell, close


def _part(now: Snapshot, part: str) -> dict[str, Any]:
    """Quantity -> mean and sd; null where a number is none."""
    told: dict[str, Any] = {
        name: {"mean": plain(value), "sd": plain(now.sd[part][name])}
        for name, value in now.mean[part].items()
    }
    return {"stamp_s": now.stamp / 1e9, **told}


def _publish(client: Any, topic: str, document: Any) -> Any:
    return client.publish(topic, json.dumps(document), AT_LEAST_ONCE, retain=True)
