"""What a stream lacked: samples that did not come, and values that nobody could use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.signal import Sample
from urdyn.signal.stretches import GAP
from urdyn.types import Array

NOTABLE = 1.0  # [s] in which nothing could be tracked for samples came too seldom, worth a sentence


@dataclass(frozen=True, eq=False)
class Losses:
    """Counts since the run began; J joints."""

    silent: Array  # (J,) samples without a current
    gaps: int = 0  # longer than GAP periods
    missing: int = 0  # samples that these would have held
    longest: float = 0.0  # [s] the longest time without a sample
    repeated: int = 0  # stamps that came twice
    clock_set: int = 0  # stamps before the one before; of a live robot also too far beyond it
    sparse: int = 0  # samples between gaps, too few in a row to learn from
    sparse_s: float = 0.0  # [s] that they and these gaps took
    sparse_since: float = np.nan  # [s] stamp at which they began
    lost: int = 0  # samples that did not come from a source while it was listened to


def no_losses(joints: int) -> Losses:
    """Before the first sample."""
    return Losses(np.zeros(joints))


def counted(
    so_far: Losses,
    sample: Sample,
    last: float,
    period: float,
    since: float,
    few: int,
    lost: int = 0,
) -> Losses:
    """With one sample more.

    Args:
        last: the stamp before [s], NaN before the first.
        since: the stamp [s] of the first sample of the stretch that `last` ended.
        few: how many that stretch held, 0 where they were enough to learn from.
        lost: how many were waited for before it.
    """
    dt = sample.t - last
    gap = dt > GAP * period
    sparse = gap and few > 0
    began = since if np.isnan(so_far.sparse_since) else so_far.sparse_since
    return Losses(
        silent=so_far.silent + np.isnan(sample.current),
        gaps=so_far.gaps + gap,
        missing=so_far.missing + (round(dt / period) - 1 if gap else 0),
        longest=max(so_far.longest, dt) if dt > 0.0 else so_far.longest,
        repeated=so_far.repeated + (dt == 0.0),
        clock_set=so_far.clock_set + (dt < 0.0),
        sparse=so_far.sparse + (few if sparse else 0),
        sparse_s=so_far.sparse_s + (sample.t - since if sparse else 0.0),
        sparse_since=began if sparse else so_far.sparse_since,
        lost=so_far.lost + lost,
    )


def too_sparse(losses: Losses, period: float) -> dict[str, float] | None:
    """Since when [s], for how long and at which steps samples came too seldom; None: hardly ever.

    As of a stream whose rate changed: gaps follow one another, and nothing can be tracked.
    """
    if losses.sparse_s < NOTABLE:
        return None
    return {
        "since": float(losses.sparse_since),
        "for_s": float(losses.sparse_s),
        "step_s": float(losses.sparse_s / losses.sparse),
        "period_s": period,
    }


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
        "clock_set": int(losses.clock_set),
        "refused": int(refused),
        "undrawn": int(undrawn),
        "without_current": share.tolist(),
        "defects": list(defects),
    }
