"""Diagnosis of a run: instants in, DIR/findings.json and the stored state out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.findings.acknowledge import Acknowledged, acknowledged, as_set, forget_gone
from urdyn.diagnose.findings.document import findings_document
from urdyn.diagnose.job import Job
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.memory import Memory
from urdyn.diagnose.reading_row import SERIES
from urdyn.diagnose.state import Now, State
from urdyn.io import write_text
from urdyn.io.run_folder import FINDINGS
from urdyn.signal import Instant
from urdyn.types import Array


class Session:
    """A job in progress."""

    def __init__(self, job: Job) -> None:
        self.job, self.diagnosis = job, Diagnosis(job.fit, job.period, job.rules)
        self._memory = Memory(job.folder, job.identity)
        start = self._memory.at(job.index) if job.index else self.diagnosis.init()
        self._state: State = start
        self._restarts, self._load_as_set = 0, False

    def take(self, numbers: Array) -> list[Finding]:
        """Process some instants, as `reading_row` has them; returns what is new or worse."""
        found: list[Finding] = []
        for now in _instants(numbers.reshape(-1, 1 + SERIES * self.diagnosis.space.joints)):
            self._state, more = self.diagnosis.step(self._state, now)
            found += more
        return found

    def note(self, restarts: int, load_as_set: bool) -> None:
        """Note what the run knows and no instant contains: see `Observer`."""
        self._restarts, self._load_as_set = restarts, load_as_set

    def finish(self) -> list[Finding]:
        """End the stream; returns the findings of the last rows."""
        self._state, found = self.diagnosis.finish(self._state)
        forget_gone(self.job.folder, self.diagnosis.findings(self._state), ended=True)
        return found

    def keep(self, index: int) -> None:
        """Store this sample; keep the one before until the run is stored as well."""
        self._memory.keep(self._state, index)

    def write(self) -> dict[str, Any]:
        """Update DIR/findings.json; returns its content."""
        job, now = self.job, self.diagnosis.findings(self._state)
        known = forget_gone(job.folder, now)
        observability = self.diagnosis.observable(self._state)
        document = findings_document(
            self._marked(now, known),
            joints=job.fit.dynamics.arm.joint_names,
            judged=self.diagnosis.judged(self._state),
            observability=observability,
            identity=job.identity,
            source=job.source,
            rules=job.rules,
            restarts=self._restarts,
        )
        write_text(job.folder / FINDINGS, json.dumps(document, indent=2) + "\n")
        return document

    def untold(self, found: Sequence[Finding]) -> list[dict[str, Any]]:
        """The findings that nobody has acknowledged yet."""
        told = self._marked(found, acknowledged(self.job.folder))
        return [finding.plain() for finding in told if not finding.acknowledged]

    def _marked(self, findings: Sequence[Finding], known: Acknowledged) -> list[Finding]:
        """Findings, with those marked that have been seen."""
        told = [replace(f, acknowledged=known.quiets(f)) for f in findings]
        return as_set(told) if self._load_as_set else told


def _instants(rows: Array) -> list[Now]:
    """The instants in a tracker's rows, (N, 1 + 10 J)."""
    series = rows[:, 1:].reshape(len(rows), SERIES, -1)
    pairs = zip(rows[:, 0].tolist(), series, strict=True)
    return [Now(Instant(t, *of[:-2]), *of[-2:]) for t, of in pairs]
