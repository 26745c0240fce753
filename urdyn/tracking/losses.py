"""What a stream lacked: samples that did not come, and values that nobody could use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.signal import Sample
from urdyn.signal.stretches import GAP
from urdyn.types import Array


@dataclass(frozen=True, eq=False)
class Losses:
    """Counts since the run began; J joints."""

    silent: Array  # (J,) samples without a current
    gaps: int = 0  # longer than GAP periods
    missing: int = 0  # samples that these would have held
    longest: float = 0.0  # [s] the longest time without a sample
    repeated: int = 0  # stamps that came twice
    back: int = 0  # stamps before the one before: a clock that was set


def no_losses(joints: int) -> Losses:
    """Before the first sample."""
    return Losses(np.zeros(joints))


def counted(so_far: Losses, sample: Sample, last: float, period: float) -> Losses:
    """With one sample more; `last` is the stamp before [s], NaN before the first."""
    dt = sample.t - last
    gap = dt > GAP * period
    return Losses(
        silent=so_far.silent + np.isnan(sample.current),
        gaps=so_far.gaps + gap,
        missing=so_far.missing + (round(dt / period) - 1 if gap else 0),
        longest=max(so_far.longest, dt) if dt > 0.0 else so_far.longest,
        repeated=so_far.repeated + (dt == 0.0),
        back=so_far.back + (dt < 0.0),
    )


def as_plain(
    losses: Losses, refused: int, undrawn: int, defects: Sequence[str], samples: int
) -> dict[str, Any]:
    """In plain numbers, as `urdyn track` prints them.

    Args:
        refused: angles and speeds that no arm can have had.
        undrawn: currents that no motor draws.
        defects: damage that was met while the source was read.
    """
    share = losses.silent / max(samples, 1)
    return {
        "gaps": int(losses.gaps),
        "missing": int(losses.missing),
        "longest_step_s": float(losses.longest),
        "repeated": int(losses.repeated),
        "clock_set_back": int(losses.back),
        "refused": int(refused),
        "undrawn": int(undrawn),
        "without_current": share.tolist(),
        "defects": list(defects),
    }
