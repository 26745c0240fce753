"""What plants are told: base units for Prometheus, retained JSON on a real broker."""

from __future__ import annotations

import json
import socket
import socketserver
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.io.address import parse
from urdyn.io.rtde import parse_address
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Level, Status

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
JOINTS = ("shoulder_pan_joint", "elbow_joint")
QUANTITIES = ("friction", "coulomb", "viscous", "structural", "health", "offset", "zero")
STATUSES = (Status(Level.WARN, "urdyn: elbow_joint", "rust"), Status(Level.OK, "urdyn: arm", "ok"))


def snapshot(coulomb: float = 3.0) -> Snapshot:
    mean = {joint: dict.fromkeys(QUANTITIES, coulomb + k) for k, joint in enumerate(JOINTS)}
    sd = {joint: dict.fromkeys(QUANTITIES, 0.5) for joint in JOINTS}
    payload = {"mass": 1.25, "mx": 0.0, "my": 0.0, "mz": 0.1}
    return Snapshot(
        "20235",
        1_500_000_000,
        77,
        JOINTS,
        mean | {"payload": payload},
        sd | {"payload": dict.fromkeys(payload, 0.02)},
        {},
        np.array([1.0, 2.0]),
        np.array([0.1, np.nan]),
        np.array([0, 0, 0.08]),
        np.ones((2, 2)),
        delay=0.5,
    )


def test_an_address_is_on_loopback_unless_told():
    assert parse("9100", 1, "x") == ("127.0.0.1", 9100)
    assert parse("broker", 1883, "x") == ("broker", 1883)
    assert parse("0.0.0.0:9100", 1, "x") == ("0.0.0.0", 9100)
    assert parse("[::1]:9100", 1, "x") == ("::1", 9100)
    assert parse(":9100", 1, "x") == ("127.0.0.1", 9100)
    for none in ("0", "broker:0"):  # which would be any port, told to nobody
        with pytest.raises(InputError, match="0 is no port"):
            parse(none, 1, "x")
    for bad in ("host:port", "1.2.3.4:99999", "::1", "me@host", "host:", ""):
        with pytest.raises(InputError, match="write PORT"):
            parse(bad, 1, "x")


@pytest.mark.parametrize("name", [".bad", "a..b", "a" * 64])
def test_a_name_that_no_host_can_have_is_no_address(name: str) -> None:
    with pytest.raises(InputError, match="write PORT, HOST or HOST:PORT"):
        parse(name, 1, "x")
    with pytest.raises(InputError, match="is no address"):
        parse_address(f"rtde://{name}")


def test_prometheus_scrapes_base_units(free_port):
    pytest.importorskip("prometheus_client", reason="the extra plants is not installed")
    from urdyn.io.plants.prometheus import serve

    endpoint = serve(str(free_port))
    try:
        endpoint.tell(snapshot(), STATUSES)
        endpoint.tell(snapshot(5.0), STATUSES)
        with pytest.raises(InputError, match=str(free_port)):
            serve(str(free_port))
        with urllib.request.urlopen(f"http://127.0.0.1:{free_port}/metrics", timeout=60) as page:
            lines = page.read().decode().splitlines()
    finally:
        endpoint.close()
    joint = 'joint="elbow_joint",robot="20235"'
    assert f"urdyn_joint_friction_newton_metres{{{joint}}} 6.0" in lines
    assert f"urdyn_joint_friction_newton_metres_sd{{{joint}}} 0.5" in lines
    assert f"urdyn_joint_health_ratio{{{joint}}} 6.0" in lines
    assert 'urdyn_delay_seconds{robot="20235"} 0.5' in lines
    assert 'urdyn_payload_mass_kilograms{robot="20235"} 1.25' in lines
    assert 'urdyn_status{part="elbow_joint",robot="20235"} 1.0' in lines


@pytest.fixture
def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def broker_process(free_port: int) -> Iterator[subprocess.Popen[bytes]]:
    """A real MQTT broker on the loopback."""
    pytest.importorskip("amqtt", reason="no broker is installed")
    script = Path(__file__).with_name("mqtt_broker.py")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, str(script), str(free_port)], **quiet)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", free_port)) == 0:
                break
        time.sleep(0.1)
    yield process
    process.kill()
    process.wait()


@pytest.fixture
def broker(broker_process: subprocess.Popen[bytes], free_port: int) -> int:
    """Where it is."""
    return free_port


def test_an_arm_is_online_again_once_another_of_its_name_has_gone():
    from urdyn.io.plants.mqtt import Broker

    kept: dict[str, str] = {}
    client = SimpleNamespace(
        is_connected=lambda: True, publish=lambda topic, text, *_, **__: kept.update({topic: text})
    )
    kept["urdyn/20235/online"] = "false"
    Broker(client, "20235").tell(snapshot(), STATUSES)
    assert kept["urdyn/20235/online"] == "true"


def test_a_broker_keeps_the_newest_state_for_those_who_come_later(broker):
    pytest.importorskip("paho", reason="the extra plants is not installed")
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    from urdyn.io.plants.mqtt import connect

    listening = connect(f"127.0.0.1:{broker}", "20235")
    listening.tell(snapshot(), STATUSES)
    listening.tell(snapshot(5.0), STATUSES)
    listening.close()
    told: dict[str, tuple[dict, bool, int]] = {}
    late = Client(CallbackAPIVersion.VERSION2)
    late.on_message = lambda _c, _u, m: told.update(
        {m.topic: (json.loads(m.payload), m.retain, m.qos)}
    )
    late.connect("127.0.0.1", broker)
    late.subscribe("urdyn/#", qos=1)
    late.loop_start()
    deadline = time.monotonic() + 60
    while len(told) < 5 and time.monotonic() < deadline:
        time.sleep(0.05)
    late.disconnect()
    late.loop_stop()
    elbow, retained, qos = told["urdyn/20235/joint/elbow_joint"]
    assert elbow["coulomb"] == {"mean": 6.0, "sd": 0.5} and elbow["stamp_s"] == 1.5
    assert retained and qos == 1
    assert told["urdyn/20235/payload"][0]["mass"]["mean"] == 1.25
    assert told["urdyn/20235/status"][0]["parts"]["elbow_joint"] == ["WARN", "rust"]
    assert told["urdyn/20235/online"][0] is False


def test_a_broker_that_goes_away_is_told_nothing_old_and_ends_no_run(
    broker_process, free_port, monkeypatch
):
    """What was said while it was away is left unsaid: a second later there is newer news."""
    pytest.importorskip("paho", reason="the extra plants is not installed")
    from urdyn.io.plants.mqtt import connect

    listening = connect(f"127.0.0.1:{free_port}", "20235")
    listening.tell(snapshot(), STATUSES)
    broker_process.kill()
    deadline = time.monotonic() + 60
    while listening.client.is_connected() and time.monotonic() < deadline:
        time.sleep(0.05)
    said = []
    with monkeypatch.context() as patch:
        patch.setattr(listening.client, "publish", lambda *said_, **_: said.append(said_))
        listening.tell(snapshot(5.0), STATUSES)
    assert said == []
    listening.close()


def test_a_joint_is_one_level_of_a_topic_whatever_its_name():
    """And its arm's findings are told before the joints."""
    from urdyn.io.plants.mqtt import Broker

    said: list[str] = []
    client = SimpleNamespace(
        is_connected=lambda: True, publish=lambda topic, *_, **__: said.append(topic)
    )
    names = ("elbow#1", "a+b", "a/b", "a%2Fb", "plain_joint")
    values = {part: {"coulomb": 1.0} for part in (*names, "payload")}
    Broker(client, "r").tell(replace(snapshot(), joints=names, mean=values, sd=values), STATUSES)
    first, *joints, payload, online = said
    assert [first, payload, online] == [f"urdyn/r/{of}" for of in ("status", "payload", "online")]
    assert not any(sign in topic for topic in said for sign in "#+")
    levels = [topic.split("/") for topic in joints]
    assert [unquote(level) for *_, level in levels] == [*names]
    assert {len(level) for level in levels} == {4} and levels[-1][-1] == "plain_joint"


@pytest.mark.parametrize("robot", ["cell#2", "a+b", "hall/3", "nul\0"])
def test_a_robot_that_no_topic_can_be_named_after_is_one_line(robot):
    pytest.importorskip("paho", reason="the extra plants is not installed")
    from urdyn.io.plants.mqtt import connect

    with pytest.raises(InputError, match="no topic can be named after"):
        connect("127.0.0.1:1883", robot)


def test_a_broker_that_is_not_there_is_one_line(free_port):
    pytest.importorskip("paho", reason="the extra plants is not installed")
    from urdyn.io.plants.mqtt import connect

    with pytest.raises(InputError, match=f"MQTT broker 127.0.0.1:{free_port}"):
        connect(f"127.0.0.1:{free_port}", "x")


@pytest.fixture
def strict_broker(free_port: int) -> Iterator[tuple[int, list[bytes]]]:
    """One that lets nobody in, whom it does not know or at all; and what it was told."""
    heard: list[bytes] = []

    class Refusal(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            heard.append(self.request.recv(1024))
            known = b"of gold" in heard[-1]
            self.request.sendall(bytes([0x20, 2, 0, 3 if known else 5]))  # CONNACK

    with socketserver.ThreadingTCPServer(("127.0.0.1", free_port), Refusal) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield free_port, heard
        server.shutdown()


def test_a_broker_that_refuses_us_is_one_line(strict_broker, monkeypatch):
    pytest.importorskip("paho", reason="the extra plants is not installed")
    from urdyn.io.plants.mqtt import connect

    port, heard = strict_broker
    with pytest.raises(InputError, match=f"127.0.0.1:{port}: Not authorized; URDYN_MQTT_USER"):
        connect(f"127.0.0.1:{port}", "x")
    monkeypatch.setenv("URDYN_MQTT_USER", "arm")
    monkeypatch.setenv("URDYN_MQTT_PASSWORD", "of gold")
    with pytest.raises(InputError, match=f"127.0.0.1:{port}: Server unavailable$"):
        connect(f"127.0.0.1:{port}", "x")
    assert b"\x00\x03arm\x00\x07of gold" in heard[1]
