"""`urdyn track` beside a driver, in processes of their own, over DDS on the loopback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from urdyn.errors import InputError, LogError
from urdyn.io import Effort, write
from urdyn.io.ros2.domain import participant, reader
from urdyn.io.ros2.talk import TOPICS, dds_types
from urdyn.simulate import simulate
from urdyn.tracking import open_source
from urdyn.tracking.sources import ros2_source

pytestmark = pytest.mark.flaky(reruns=2)  # in real time: a busy machine may miss a sample once
ROOT = Path(__file__).parents[2]
PUBLISHER = ROOT / "tests" / "io" / "ros2" / "ros_publisher.py"


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A ROS domain of the test's own, on the loopback."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(101 + os.getpid() % 99))
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "1")
    monkeypatch.setenv("CYCLONEDDS_URI", "")
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}


def beside_a_driver(workshop, ur5e, tmp_path, environment, count: int, *options: str):
    """Summary of a run over `count` samples at 500 Hz; what it published; ages of estimates [s]."""
    write(simulate(ur5e, count / 500.0, 500.0, seed=1)[0], tmp_path / "driver.parquet")
    types = dds_types()
    at = participant()
    readers = {topic: reader(at, topic, types.of(name)) for topic, name in TOPICS.items()}
    track = [sys.executable, "-m", "urdyn", "track", str(workshop.twin), "ros2://joint_states"]
    track += ["--out", str(tmp_path / "out"), "--effort-unit", "A", "--duration", str(count / 500)]
    publish = [sys.executable, str(PUBLISHER), str(count), str(tmp_path / "driver.parquet"), "60"]
    told = {topic: [] for topic in TOPICS}
    ages = []
    driver = subprocess.Popen(publish, env=environment)
    tracking = subprocess.Popen([*track, "--json", *options], env=environment, stdout=-1, stderr=-1)
    try:
        deadline = time.monotonic() + count / 500 + 120
        while tracking.poll() is None and time.monotonic() < deadline:
            for topic, source in readers.items():
                came = [m for m in source.take(N=200) if hasattr(m, "__idl_typename__")]
                came = [m for m in came if type(m).__name__ != "InvalidSample"]
                told[topic] += came
                if topic == "/urdyn/estimates":
                    now = time.time()
                    stamps = [m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in came]
                    ages += [now - stamp for stamp in stamps]
            time.sleep(0.0005)
        out, err = tracking.communicate(timeout=60)
    finally:
        for process in (driver, tracking):
            process.kill()
            process.wait()
    assert tracking.returncode == 0, err.decode()
    return json.loads(out), told, np.array(ages)


def test_a_driver_s_joint_states_become_estimates_and_diagnoses(
    workshop, ur5e, tmp_path, environment
):
    options = ("--serial", "20235", "--publish", "feed_forward", "--hand-over", "payload")
    summary, told, _ = beside_a_driver(workshop, ur5e, tmp_path, environment, 1000, *options)
    assert summary["samples"] == 1000 and summary["lost"] == 0
    assert (tmp_path / "out" / "payload.script").read_text().startswith("set_payload(")
    assert len(told["/urdyn/feed_forward"]) > 900 and not told["/urdyn/friction_scales"]
    estimate = told["/urdyn/estimates"][-1]
    assert estimate.joint_names[-1] == "payload" and "elbow_joint" in estimate.joint_names
    for array in told["/diagnostics"]:
        assert len(array.status) == 7 and array.status[0].hardware_id == "20235"
    assert told["/diagnostics"]


@pytest.mark.slow
def test_of_fifteen_thousand_none_is_lost_and_all_are_fresh(workshop, ur5e, tmp_path, environment):
    summary, told, ages = beside_a_driver(workshop, ur5e, tmp_path, environment, 15_000)
    assert summary["samples"] == 15_000 and summary["lost"] == 0
    assert len(told["/urdyn/estimates"]) > 270  # ten a second, of half a minute
    assert np.quantile(ages[10:], 0.99) < 5e-3  # the first fifty samples wait for their rate


def test_what_is_not_there_is_one_line(environment, monkeypatch):
    monkeypatch.setattr(ros2_source, "PATIENCE", 0.3)
    with pytest.raises(InputError, match="no joint states of an arm in"):
        open_source("ros2://joint_states", effort=Effort("A"))
    with pytest.raises(LogError, match="--effort-unit A"):
        open_source("ros2://joint_states")
