"""How much memory this process has had."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path

UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in a unit of ru_maxrss


def peak_rss() -> float:
    """Most that was resident at once [B].

    Linux counts the memory of whoever started a process into its ru_maxrss; VmHWM is its own.
    """
    status = Path("/proc/self/status")
    if status.exists() and (own := re.search(r"VmHWM:\s+(\d+) kB", status.read_text())):
        return 1024.0 * int(own[1])
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT)
