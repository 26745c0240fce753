"""What a stream lacked: samples that did not come, and values that could not be used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.signal import Sample
from urdyn.signal.stretches import GAP
from urdyn.types import Array

NOTABLE = 1.0  # [s] of samples too sparse to track, from which on it is reported


@dataclass(frozen=True, eq=False)
class Losses:
    """Losses since the run began; J joints."""

    silent: Array  # (J,) samples without a current, where there should be one
    gaps: int = 0  # steps longer than GAP periods
    gaps_s: float = 0.0  # [s] that these took
    missing: int = 0  # samples lost in these
    longest: float = 0.0  # [s] longest time between samples
    repeated: int = 0  # repeated stamps
    clock_set: int = 0  # stamps before the previous one; of a live robot, also too far beyond it
    sparse: int = 0  # samples between gaps, too few in a row to learn from
    sparse_s: float = 0.0  # [s] that they and the gaps took
    sparse_since: float = np.nan  # [s] stamp at which they began
    lost: int = 0  # samples that a live source did not deliver
    undriven: int = 0  # samples of an arm moved by hand or without power
    in_contact: int = 0  # samples of an arm that works in contact


def no_losses(joints: int) -> Losses:
    """Losses before the first sample."""
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
    """The losses after one more sample.

    Args:
        last: the previous stamp [s], NaN before the first.
        since: stamp [s] of the first sample of the stretch that ends at `last`.
        few: number of samples in that stretch, 0 if enough to learn from.
        lost: number of samples missed before this one.
    """
    dt = sample.t - last
    gap = dt > GAP * period
    sparse = gap and few > 0
    began = since if np.isnan(so_far.sparse_since) else so_far.sparse_since
    withheld = sample.undriven or sample.in_contact
    return Losses(
        silent=so_far.silent + (np.isnan(sample.current) & (not withheld)),
        gaps=so_far.gaps + gap,
        gaps_s=so_far.gaps_s + (dt if gap else 0.0),
        missing=so_far.missing + (round(dt / period) - 1 if gap else 0),
        longest=max(so_far.longest, dt) if dt > 0.0 else so_far.longest,
        repeated=so_far.repeated + (dt == 0.0),
        clock_set=so_far.clock_set + (dt < 0.0),
        sparse=so_far.sparse + (few if sparse else 0),
        sparse_s=so_far.sparse_s + (sample.t - since if sparse else 0.0),
        sparse_since=began if sparse else so_far.sparse_since,
        lost=so_far.lost + lost,
        undriven=so_far.undriven + sample.undriven,
        in_contact=so_far.in_contact + sample.in_contact,
    )


def too_sparse(losses: Losses, period: float) -> dict[str, float] | None:
    """When [s], for how long and at which steps samples were too sparse; None: hardly ever.

    For instance, after a change of the stream's rate gap follows gap, and nothing can be tracked.
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
    """The losses in plain numbers, as `urdyn track` prints them.

    Args:
        refused: angles and speeds that no arm can have had.
        undrawn: currents that no motor draws.
        defects: damage that was found while reading the source.
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
        "undriven": int(losses.undriven),
        "in_contact": int(losses.in_contact),
        "without_current": share.tolist(),
        "defects": list(defects),
    }
