"""The peak memory of this process."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path

UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in a unit of ru_maxrss


def peak_rss() -> float:
    """Peak resident memory [B].

    On Linux, ru_maxrss includes the memory of the process that started this one; VmHWM does not.
    """
    status = Path("/proc/self/status")
    if status.exists() and (own := re.search(r"VmHWM:\s+(\d+) kB", status.read_text())):
        return 1024.0 * int(own[1])
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT)
