"""The streams, of those that are available, that a twin uses beside its joints' sensors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.identify.kinematics.calibration import drawn
from urdyn.identify.kinematics.record import Recorded
from urdyn.identify.kinematics.spread import geometry_spread
from urdyn.io.poses import read_pose_stream
from urdyn.model.arm import Arm
from urdyn.model.geometry.drawing import drawing_of
from urdyn.signal import POSE
from urdyn.tracking.belief.model import Drift
from urdyn.tracking.sources.source import Arrival, Source
from urdyn.tracking.streams.pose_belief import Build
from urdyn.tracking.streams.pose_stream import STRAY, PoseStream
from urdyn.tracking.streams.stream import Stream
from urdyn.tracking.streams.wrench_stream import WrenchStream
from urdyn.types import Array, Gaussian, frozen

# While a tracker watches, a joint's zero stays where it is, until poses show that it slipped.
WATCHED = Drift(zero=0.0, zero_memory=float("inf"), zero_walk=STRAY)
# Wrench streams that a source may have, best first: a raw one has no unknown compensation.
WRENCHES = ("raw_wrench", "wrench")
NOTHING = frozen(np.zeros(10))


def beside(
    arm: Arm,
    source: Source,
    *,
    tracked: bool = False,
    known: Recorded | None = None,
    tool: Array = NOTHING,
) -> tuple[Stream[Any], ...]:
    """The streams of a source, for an arm that may be calibrated.

    Args:
        tracked: its poses are those of a tracker, not the controller's own.
        tool: inertials (10,) of a tool that the twin knows, which its payload does not include.
    """
    poses = [pose_stream(arm, not tracked, known)] if POSE in source.beside else []
    felt = [WrenchStream(arm, w == "raw_wrench", tool=tool) for w in WRENCHES if w in source.beside]
    return (*poses, *felt[:1])


def pose_stream(arm: Arm, own: bool, known: Recorded | None = None) -> PoseStream:
    """The stream of the controller's poses, or of a tracker's, for an arm that may be calibrated.

    Without a calibration, the arm deviates from its drawing as much as real arms do.
    """
    drawing = drawing_of(arm)
    start = drawn(arm, drawing)
    cov = np.diag(geometry_spread(drawing.form) ** 2)
    if known is not None:
        at = known.full or known.geometric
        start = replace(start, table=at.table, effects=at.effects, coefficients=at.coefficients)
        cov = cov if known.cov is None else np.array(known.cov)
    return PoseStream(Build(start, Gaussian(start.deviations, cov), own))


def with_poses(source: Source, path: str | Path) -> Source:
    """A recording, with the poses that a tracker measured during it, by the same clock.

    Each pose comes with the first sample stamped at or after it.

    Raises:
        InputError: the source is live; or, at its end, no pose was measured during it.
    """
    if source.live:
        raise InputError(f"{path}: poses from a file go with a log, not with a live robot")
    rows, sha256 = read_pose_stream(path)

    def start(first: int) -> Iterator[Arrival]:
        came, begun, last = 0, np.inf, -np.inf
        for index, arrival in enumerate(source.start(max(first - 1, 0)), max(first - 1, 0)):
            until = int(np.searchsorted(rows[:, 0], arrival.sample.t, side="right"))
            if index >= first:
                yield _beside(arrival, rows[came:until])
            came = until
            begun, last = min(begun, arrival.sample.t), max(last, arrival.sample.t)
        if first == 0 and not np.any((rows[:, 0] >= begun) & (rows[:, 0] <= last)):
            theirs = f"{rows[0, 0]:.2f} to {rows[-1, 0]:.2f} s"
            raise InputError(
                f"{path}: no pose was measured meanwhile: they are stamped {theirs}, and "
                f"{source.name} {begun:.2f} to {last:.2f} s; both have to go by one clock"
            )

    identity = f"{source.identity} {sha256}"
    return replace(source, identity=identity, start=start, beside=source.beside | {POSE})


def _beside(arrival: Arrival, rows: Array) -> Arrival:
    """The arrival with a tracker's poses in the place of the controller's."""
    sample = arrival.sample
    return replace(arrival, sample=replace(sample, beside={**sample.beside, POSE: rows}))
