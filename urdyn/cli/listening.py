"""What options ask `urdyn track` to listen to beside the joints' own sensors."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from urdyn.errors import InputError

if TYPE_CHECKING:
    from urdyn.model.dynamics import Dynamics
    from urdyn.tracking import Drift, Source
    from urdyn.tracking.streams.stream import Stream

OWN = "own"  # poses: the controller's
MISSING = {
    "pose": "actual_TCP_pose; name the file of a tracker's poses by --poses",
    "wrench": "actual_TCP_force or ft_raw_wrench; leave --wrench out",
}


def wanted(poses: str | None, wrench: bool) -> tuple[str, ...]:
    """The streams that were asked for; a tracker's poses take the place of the source's own."""
    return (*(("pose",) if poses else ()), *(("raw_wrench", "wrench") if wrench else ()))


def listening(
    source: Source, of: Dynamics, poses: str | None, wrench: bool, calibration: Path | None
) -> tuple[Source, tuple[Stream[Any], ...], Drift | None]:
    """The source with what was asked for, its streams, and the drift of zeros with them."""
    if not poses and not wrench:
        return source, (), None
    # Imported here: without poses, a twin does not hold calibration in memory.
    from urdyn.identify.kinematics import load_calibration
    from urdyn.tracking.streams.of_source import WATCHED, beside, with_poses

    tracked = poses not in (None, OWN)
    if tracked:
        source = with_poses(source, Path(str(poses)))
    for asked, what in ((poses, "pose"), (wrench, "wrench")):
        if asked and not any(what in stream for stream in source.beside):
            raise InputError(f"{source.name}: has no {MISSING[what]}")
    known = load_calibration(calibration, of.arm) if calibration else None
    if known:  # a resumed run begins where it did
        begins = sha256((known.full or known.geometric).deviations.tobytes()).hexdigest()
        source = replace(source, identity=f"{source.identity} {begins}")
    streams = beside(of.arm, source, tracked=tracked, known=known, tool=of.payload)
    return source, streams, WATCHED if tracked else None


def unused(summary: dict[str, Any]) -> str:
    """A remark on poses that fitted no such arm; empty where some did, or none came."""
    prefix = "kinematics."
    told = [of["mean"] for name, of in summary["final"].items() if name.startswith(prefix)]
    if not told or any(mean is not None for mean in told):
        return ""
    return (
        "the poses told nothing of this arm: too few, too much alike, or not in m, rad and its "
        "base's axes; zeros are as sure as if some had been watched, so leave --poses out"
    )
