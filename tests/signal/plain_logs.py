"""Logs of a few channels, and what was counted in them."""

from __future__ import annotations

import numpy as np

from urdyn.types import Array, Log


def log_of(t: Array, **channels: Array) -> Log:
    return Log(t, channels)


def clock(rate: float, seconds: float, start: float = 0.0) -> Array:
    return start + np.arange(round(seconds * rate) + 1) / rate


def counts(log: Log) -> dict[str, int]:
    return {defect.kind: defect.count for defect in log.defects}
