"""Two processes on the loopback, in a ROS domain of the test's own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

HERE = Path(__file__).parent
Publish = Callable[..., subprocess.Popen[bytes]]


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """Tests that run beside this one, and robots, hear nothing of it."""
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    number = 1 + os.getpid() % 99
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "1")
    monkeypatch.setenv("CYCLONEDDS_URI", "")
    return number


@pytest.fixture
def publish(domain: int) -> Iterator[Publish]:
    """Start a publisher of joint states; it is gone when the test is over."""
    begun: list[subprocess.Popen[bytes]] = []

    def start(*arguments: object) -> subprocess.Popen[bytes]:
        command = [sys.executable, str(HERE / "ros_publisher.py"), *map(str, arguments)]
        path = os.pathsep.join(filter(None, (str(HERE.parents[2]), os.environ.get("PYTHONPATH"))))
        begun.append(subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path}))
        return begun[-1]

    yield start
    for process in begun:
        process.kill()
        process.wait()
