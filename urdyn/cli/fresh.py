"""`urdyn` in a process of its own: its time, memory and output."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

from urdyn.errors import UrdynError
from urdyn.io.rss import UNIT

# Linux counts the parent's memory as the peak of a child that it starts; so this process starts a
# small one, which starts the one that is measured, and prints its peak in a last line.
SMALL = """
import os, sys
command = [sys.executable, "-m", "urdyn", *sys.argv[1:]]
_, status, usage = os.wait4(os.posix_spawn(sys.executable, command, os.environ), 0)
print(usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status) != 0)
"""


@dataclass(frozen=True)
class Took:
    """A verb's cost, from starting its process to its end, and its output."""

    wall: float  # [s]
    rss: float  # [B] peak
    said: str  # on standard output


def fresh(*arguments: str) -> Took:
    """Run a verb quietly; UrdynError with what it said if it fails."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as complained:
        command = (sys.executable, "-S", "-c", SMALL, *arguments, "-q")
        begin = time.perf_counter()
        failed = subprocess.run(command, stdout=said, stderr=complained, check=False).returncode
        wall = time.perf_counter() - begin
        said.seek(0)
        complained.seek(0)
        if failed:
            words = (complained.read() or said.read()).decode(errors="replace").strip()
            raise UrdynError(f"urdyn {arguments[0]}: {words}")
        words, _, peak = said.read().decode().rstrip().rpartition("\n")
        return Took(wall, int(peak) * UNIT, words)
