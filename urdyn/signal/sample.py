"""One row of a log and one row of a motion: what a live stream is made of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from urdyn.types import Array, Log


@dataclass(frozen=True)
class Sample:
    """One row of a log."""

    t: float  # [s]
    q: Array  # (J,) [rad]; NaN where not measured, here and below
    v: Array  # (J,) [rad/s]
    current: Array  # (J,) [A]
    temperature: Array  # (J,) [°C]


@dataclass(frozen=True)
class Instant:
    """One row of a motion."""

    t: float  # [s] stamp of the current
    q: Array  # (J,) [rad], at t + offset, here and below
    v: Array  # (J,) [rad/s]
    a: Array  # (J,) [rad/s²]
    jerk: Array  # (J,) [rad/s³]
    current: Array  # (J,) [A] as measured
    temperature: Array  # (J,) [°C]


def samples(log: Log) -> Iterator[Sample]:
    """The rows of a log as they came, to replay it."""
    names = ("actual_q", "actual_qd", "actual_current", "joint_temperatures")
    rows = zip(*(log.joint(name) for name in names), strict=True)
    return (Sample(float(t), *row) for t, row in zip(log.t, rows, strict=True))
