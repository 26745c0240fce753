"""A recording diagnosed at once: the same beats and moments as live, one function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.findings.acknowledge import as_set
from urdyn.diagnose.findings.document import findings_document
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.errors import InputError
from urdyn.identify.fit import Fit
from urdyn.io import sha256
from urdyn.io.run_folder import HISTORY
from urdyn.report.track.apart import draw
from urdyn.signal import condition
from urdyn.tracking import Tracker, run
from urdyn.tracking.offline import Tracked, replayed, tracker_of
from urdyn.twin import Twin
from urdyn.types import Log


@dataclass(frozen=True)
class Report:
    """What was found in a recording."""

    findings: tuple[Finding, ...]
    document: Mapping[str, Any]  # as findings.json has it
    tracker: Tracker[Any] = field(repr=False)  # that followed the arm
    log: Log = field(repr=False)

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def __str__(self) -> str:
        doubt = [self.document["doubt"]] if "doubt" in self.document else []
        told = [f"{f.severity}: {f.kind}: {f.text}" for f in self.findings]
        return "\n".join([*doubt, *told]) or "nothing found"

    def save(self, path: str | Path) -> None:
        """Write it as one HTML page with the parameters' history; tracks the log again."""
        with TemporaryDirectory() as folder:
            out = Path(folder)
            twin, history = out / "twin.toml", out / HISTORY
            Twin(self.tracker.fit.dynamics.arm, self.tracker.fit).save(twin)
            stream = replayed(self.log, self.tracker.period)
            summary = run(self.tracker, stream, out, sha256(twin))
            draw(history, summary | dict(self.document), Path(path))


def diagnose(
    of: Tracked | Twin | Fit, log: Log | None = None, rules: Rules | None = None
) -> Report:
    """The faults of an arm in a log: one already tracked, or one given with its twin.

    report = urdyn.diagnose(urdyn.track(twin, urdyn.read("monday.parquet")))
    print(report)
    report.save("monday.html")

    Args:
        log: of a twin's arm; a track has its own.

    Raises:
        InputError: there is a twin and no log, or a track and another log.
        LogError: it is of an arm with other joints, or its currents are not in amperes.
    """
    tracker, log = _followed(of, log)
    fit = tracker.fit
    motion = condition(log, offset=fit.dynamics.drive.time_offset)
    diagnosis = Diagnosis(fit, tracker.period, rules or read_rules())
    follow = fit.dynamics.bristles(motion)
    s = follow.together(fit.dynamics.drive.presliding_tail)
    state, found = diagnosis.over(motion, s, follow.travelled)
    if isinstance(of, Tracked) and of.load_as_set:
        found = as_set(found)
    source = {"source": log.source.path, "source.sha256": log.source.sha256}
    document = findings_document(
        found,
        joints=fit.dynamics.arm.joint_names,
        judged=diagnosis.judged(state),
        observability=diagnosis.observable(state),
        identity={},
        source=source,
        rules=diagnosis.rules,
        restarts=of.restarts if isinstance(of, Tracked) else 0,
    )
    return Report(tuple(found), document, tracker, log)


def _followed(of: Tracked | Twin | Fit, log: Log | None) -> tuple[Tracker[Any], Log]:
    if isinstance(of, Tracked) and log is None:
        return of.tracker, of.log
    if isinstance(of, Tracked) or log is None:
        raise InputError("a track is diagnosed by itself, and a twin with a log")
    return tracker_of(of, log), log
