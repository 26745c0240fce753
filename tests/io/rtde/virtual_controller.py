"""A controller in a process of its own, as a robot is: clients may hold this process's lock."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator

import numpy as np

from urdyn.io.rtde import serve
from urdyn.io.rtde.controller import RELEASES, Generation
from urdyn.io.rtde.fields import cycle_rate
from urdyn.io.rtde.recipe import Values

JOINTS = np.arange(6)
WRAP = 1 << 16  # cycles after which values repeat
SKIPPED = range(700, 703)  # cycles that a busy controller leaves out


def sample(cycle: int, rate: float) -> Values:
    """What the arm says in one cycle: every value tells the cycle, so a torn row shows."""
    phase = (cycle % WRAP) / WRAP  # exact in binary
    return {
        "timestamp": cycle / rate,
        "actual_q": phase + JOINTS / 8,
        "target_q": phase - JOINTS / 8,
        "actual_current": 2 * phase + JOINTS / 8,
        "actual_TCP_pose": phase / 2 + JOINTS / 8,
        "joint_temperatures": 25 + phase + JOINTS,
        "output_double_register_12": float(cycle),
        "output_int_register_12": cycle,
        "output_double_register_24": time.monotonic(),
    }


def main(host: str, port: str, generation: Generation, *skips: str) -> None:
    rate = cycle_rate(RELEASES[generation])
    cycles = (k for k in itertools.count() if not (skips and k in SKIPPED))
    samples: Iterator[Values] = (sample(k, rate) for k in cycles)
    with serve(samples, host, int(port), generation) as server:
        print(server.port, flush=True)
        sys.stdin.read()  # until the test lets go
    late = np.array(server.lateness)
    print(f"{np.percentile(late, 50):.6f} {np.percentile(late, 99):.6f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], *sys.argv[4:])  # type: ignore[arg-type]
