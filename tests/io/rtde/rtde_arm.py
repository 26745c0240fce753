"""A controller in a process of its own, on a loopback address of its own."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SCRIPT = Path(__file__).with_name("virtual_controller.py")
HOSTS = itertools.count(10)  # 127.0.0.10, ...: no test waits for the port of another


@dataclass
class Arm:
    """A running controller."""

    host: str
    port: int
    process: subprocess.Popen[str]

    def stop(self) -> str:
        """Let it end in good order; what it says of its pacing, [s] p50 and p99."""
        return self.process.communicate(timeout=60)[0]

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate(timeout=60)


Start = Callable[..., Arm]


def start_arm(host: str = "", port: int = 30004, generation: str = "e", *more: str) -> Arm:
    """By default an e-Series on the port that RTDE has."""
    host = host or f"127.0.0.{next(HOSTS)}"
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), host, str(port), generation, *more],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert process.stdout is not None
    return Arm(host, int(process.stdout.readline()), process)
