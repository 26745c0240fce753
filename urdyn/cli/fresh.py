"""`urdyn` in a process of its own: what it took, and what it said."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

from urdyn.errors import UrdynError

RSS_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in a unit of ru_maxrss


@dataclass(frozen=True)
class Took:
    """What a verb took, from starting its process to its end."""

    wall: float  # [s]
    rss: float  # [B] peak
    said: str  # on standard output


def fresh(*arguments: str) -> Took:
    """Run a verb quietly; UrdynError with what it said if it fails."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as complained:
        begin = time.perf_counter()
        child = subprocess.Popen(
            (sys.executable, "-m", "urdyn", *arguments, "-q"), stdout=said, stderr=complained
        )
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - begin
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        complained.seek(0)
        if child.returncode:
            words = complained.read() or said.read()
            raise UrdynError(f"urdyn {arguments[0]}: {words.decode(errors='replace')}")
        return Took(wall, usage.ru_maxrss * RSS_UNIT, said.read().decode())
