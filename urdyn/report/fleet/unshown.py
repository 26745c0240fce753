"""What changed of a robot that no line of the fleet shows: damping, and zeros."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from urdyn.report.fleet.gather import SHOWN, Robot
from urdyn.report.track.change import WATCHED, Change, compare_track
from urdyn.report.track.history import find_history


def unshown(robot: Robot) -> tuple[Change, ...]:
    """Changes beyond the level of a warning."""
    return _read(robot.folder, robot.written)


@cache  # page and terminal ask again and again, and days take long to read
def _read(folder: Path, written: float) -> tuple[Change, ...]:
    """Those of a history as it was `written`."""
    run = find_history(folder)
    found = (
        compare_track(run.series(joint, quantity))
        for joint in run.joints
        for quantity in WATCHED
        if quantity not in SHOWN and run.holds(joint, quantity)
    )
    return tuple(c for c in found if c.matters)
