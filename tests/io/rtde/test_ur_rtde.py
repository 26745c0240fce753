"""SDU's client library, as people have it, against our controller; it knows port 30004 only."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from rtde_arm import Start
from virtual_controller import JOINTS, WRAP

from urdyn.io import read

pytestmark = [
    pytest.mark.flaky(reruns=2),  # in real time: a busy machine may miss a sample once
    # Where the library waits for ever, it is C++ that waits: no signal of Python's gets through.
    pytest.mark.timeout(60, method="thread"),
]
receive = pytest.importorskip("rtde_receive", reason="pip install -e '.[rtde]'")


def agrees(client: object) -> bool:
    """Is what the client has the sample of one cycle?"""
    q, target = np.array(client.getActualQ()), np.array(client.getTargetQ())  # type: ignore[attr-defined]
    phase = q - JOINTS / 8
    return bool((phase == phase[0]).all() and (target == phase - JOINTS / 8).all())


@pytest.mark.parametrize("generation", ["e", "cb3", "x"])
def test_the_default_recipe_is_received(start: Start, generation: str) -> None:
    client = receive.RTDEReceiveInterface(start("", 30004, generation).host)
    assert client.isConnected()
    time.sleep(0.2)
    cycle = round(client.getTimestamp() * (125 if generation == "cb3" else 500))
    assert abs(client.getActualQ()[0] - cycle % WRAP / WRAP) < 3 / WRAP
    assert client.getOutputDoubleRegister(12) > 0 and client.getOutputIntRegister(12) > 0
    assert client.getRobotMode() == 7 and client.getSafetyMode() == 1
    assert list(client.getJointMode()) == [253] * 6
    assert client.getJointTemperatures()[5] >= 30
    client.disconnect()


def test_a_custom_recipe_is_received_at_500_hz(start: Start) -> None:
    names = ["timestamp", "actual_q", "target_q"]
    client = receive.RTDEReceiveInterface(start().host, 500.0, names)
    stamps, sound, end = set[float](), 0, time.monotonic() + 1.0
    while time.monotonic() < end:
        stamps.add(client.getTimestamp())
        sound += agrees(client)
        time.sleep(0.0002)
    client.disconnect()
    # A busy machine may look too seldom to meet every sample; those it meets are 2 ms apart.
    assert np.diff(sorted(stamps)).min() == pytest.approx(0.002)
    assert np.ptp(list(stamps)) == pytest.approx(1.0, abs=0.2)
    assert sound > 0


def test_a_file_is_recorded_that_we_read(start: Start, tmp_path: Path) -> None:
    client = receive.RTDEReceiveInterface(start().host, 500.0)
    assert client.startFileRecording(str(tmp_path / "a.csv"))
    time.sleep(1.5)
    client.stopFileRecording()
    client.disconnect()
    log = read(tmp_path / "a.csv")
    assert len(log) > 200 and log.channels["actual_q"].shape == (len(log), 6)
    np.testing.assert_allclose(log.channels["actual_q"][:, 0], log.t * 500 % WRAP / WRAP, atol=1e-3)


def test_it_reconnects(start: Start) -> None:
    arm = start()
    client = receive.RTDEReceiveInterface(arm.host, 500.0)
    arm.kill()
    time.sleep(0.3)
    assert not client.isConnected()
    start(arm.host)
    assert client.reconnect() and client.isConnected()
    first = client.getTimestamp()
    time.sleep(0.2)
    assert client.getTimestamp() > first
    client.disconnect()


def test_its_inputs_arrive_and_have_one_owner(start: Start) -> None:
    rtde_io = pytest.importorskip("rtde_io")
    host = start().host
    client, io = receive.RTDEReceiveInterface(host), rtde_io.RTDEIOInterface(host)
    assert io.setSpeedSlider(0.25) and io.setStandardDigitalOut(3, True)
    time.sleep(0.2)
    assert client.getTargetSpeedFraction() == 0.25 and client.getDigitalOutState(3)
    with pytest.raises(RuntimeError, match="already in use"):
        rtde_io.RTDEIOInterface(host)
    io.disconnect()
    client.disconnect()
