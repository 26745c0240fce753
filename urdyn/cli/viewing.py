"""Finds what a user wants to see: an arm, and a film of it or moments as they come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import urdyn as ud
from urdyn.errors import InputError, LogError, TwinError
from urdyn.identify.fit import Fit
from urdyn.io import Effort, is_log, sha256
from urdyn.model.arm import Arm, load_arm
from urdyn.model.library import robots
from urdyn.report.track.history import History, find_history
from urdyn.tracking import Tracker, open_source
from urdyn.tracking.output.checkpoint import whose
from urdyn.view.live import address, followed, tracked, watched
from urdyn.view.replay import motion, replay

if TYPE_CHECKING:
    from urdyn.types import Log
    from urdyn.view.film import Film, Moment

ROBOT = "rtde://"
WHICH = "which arm it is has to be said: --twin TWIN of `urdyn identify`, or --robot TYPE"


@dataclass(frozen=True)
class Asked:
    """The user's request."""

    source: str
    twin: Path | None = None
    robot: str | None = None
    logs: tuple[Path, ...] = ()
    columns: str | None = None
    rows: tuple[int | None, int | None] | None = None
    rate: float | None = None

    def read(self, *logs: Path) -> Log:
        """Joint angles of a log, or of several that follow each other."""
        return ud.read(
            *logs, columns=self.columns, rows=self.rows, rate=self.rate, channels=("actual_q",)
        )


@dataclass(frozen=True)
class Found:
    """An arm, and either a film or moments."""

    arm: Arm
    film: Film | None = None
    moments: Iterator[Moment] | None = None
    close: Callable[[], None] = lambda: None


def find(asked: Asked) -> Found:
    """What there is to see."""
    found = _found(asked)
    if found.film is not None and not found.film.end > 0.0:
        raise InputError(f"{asked.source}: one moment only; a film needs more")
    return found


def _found(asked: Asked) -> Found:
    if asked.source.startswith(ROBOT):
        return _robot(asked)
    path = Path(asked.source)
    if is_log(path):
        arm, _ = _arm(asked)
        return Found(arm, film=motion(asked.read(path)))
    if not path.is_dir():
        raise InputError(f"{path}: is no folder, log or {ROBOT} address that is there")
    try:
        return _folder(path, find_history(path), asked)
    except LogError as error:
        raise error if error.path else InputError(f"{path}: {error}") from error


def _robot(asked: Asked) -> Found:
    """A robot at work; if a twin is given, it is tracked from now on."""
    arm, fit = _arm(asked)
    source = open_source(asked.source)
    if fit is None:
        return Found(arm, moments=watched(source), close=source.close)
    from urdyn.estimate import EKF

    tracker: Tracker[Any] = Tracker(fit, EKF(), source.period, velocities=source.velocities)
    return Found(arm, moments=tracked(tracker, source), close=source.close)


def _folder(folder: Path, run: History, asked: Asked) -> Found:
    """A run that is over, or one in progress."""
    made_of = run.provenance
    known = made_of.get("robot")
    if known != asked.robot and {known, asked.robot} <= {*robots()}:
        raise InputError(f"{folder}: is of {known}; leave --robot {asked.robot} out")
    arm, fit = _arm(asked, known)
    if fit and asked.twin and made_of.get("twin.sha256") not in (None, "", sha256(asked.twin)):
        raise TwinError(f"{asked.twin}: is not the twin that {folder} was tracked with")
    if len(run.joints) != arm.joints:
        raise InputError(f"{folder}: has {len(run.joints)} joints, {arm.name} has {arm.joints}")
    if not run.finished and (robot := address(folder)):
        source = open_source(robot, effort=Effort("A"))  # whatever unit: only angles are shown
        return Found(arm, moments=followed(folder, source), close=source.close)
    logs = _logs(folder, run, asked)
    gain = fit.dynamics.drive.gain if fit else None
    return Found(arm, film=replay(run, asked.read(*logs), gain))


def _logs(folder: Path, run: History, asked: Asked) -> tuple[Path, ...]:
    """The logs that were tracked, or a recording of a live run: a history holds no joint angles."""
    hashes = str(run.provenance.get("source.sha256") or "")
    named = run.source.split(" ") if " " in hashes else [run.source or "?"]
    logs = asked.logs or tuple(map(Path, named))
    if not all(map(is_log, logs)):
        raise InputError(f"{folder}: {_lacking(folder, run)} by --log LOG")
    if hashes not in ("", " ".join(map(sha256, logs))):
        told = " ".join(map(str, logs))
        raise InputError(f"{told}: is not the log that {folder} is of; name that by --log LOG")
    return logs


def _lacking(folder: Path, run: History) -> str:
    """A message that joint angles are missing, and which option names a file with them."""
    about = whose(folder)
    source = run.source or about.get("source", "")
    if "://" in source:
        return (
            f"is of {source}, which was live and is shown while it goes on; now its joint angles "
            "are needed: name a recording that was made meanwhile (`urdyn record`, a bag)"
        )
    if run.source:
        return f"is of {source}; its joint angles are needed: name it"
    if about:
        return "does not say of which log it is; its joint angles are needed: name it"
    return "has just begun and does not say yet what it is of; look again soon, or name its log"


def _arm(asked: Asked, known: str | None = None) -> tuple[Arm, Fit | None]:
    """The arm, and its fit where a twin is named."""
    if asked.twin:
        fit = ud.Twin.load(asked.twin).fit
        return fit.dynamics.arm, fit
    if named := asked.robot or (known if known in robots() else None):
        return load_arm(named), None
    raise InputError(f"{asked.source}: {WHICH}")
