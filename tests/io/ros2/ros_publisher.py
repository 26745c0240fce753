"""A driver's joint states over DDS, in a process of its own: python ros_publisher.py COUNT LOG [S].

Stamps lie on a grid of 2 ms, so that a message that was lost leaves a hole; joints in the order of
the alphabet, as the driver's broadcaster has them. It waits S seconds for those who listen.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from urdyn.io import read
from urdyn.io.bags.joints import JOINTS
from urdyn.io.ros2 import idl
from urdyn.io.ros2.domain import participant, writer

PERIOD = 2_000_000  # [ns]


def main(count: int, log: str, wait: float) -> None:
    names = sorted(JOINTS)
    order = [JOINTS.index(name) for name in names]
    if log == "-":
        series = [np.arange(6.0)[None] / 7 for _ in range(3)]
    else:
        channels = read(log).channels
        series = [channels[name] for name in ("actual_q", "actual_qd", "actual_current")]
    rows = [values[:count, order].tolist() for values in series]
    at = participant()
    out = writer(at, "/joint_states", idl.JointState)
    deadline = time.monotonic() + wait
    while not out.get_matched_subscriptions() and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.5)
    begin = time.time_ns() // PERIOD * PERIOD + 10 * PERIOD
    for k in range(count):
        stamp = begin + k * PERIOD
        while (left := stamp - time.time_ns()) > 0:
            time.sleep(left / 1e9)
        told = [values[k % len(values)] for values in rows]
        header = idl.Header(idl.Time(stamp // 10**9, stamp % 10**9), "")
        out.write(idl.JointState(header, names, *told))
    time.sleep(1.0)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 20.0)
