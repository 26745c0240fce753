"""Where a run is diagnosed: instants in, DIR/findings.json and what is remembered out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from urdyn.diagnose import memory
from urdyn.diagnose.acknowledge import FOUND, acknowledged, forget_gone
from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.document import findings_document
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.state import Now, State
from urdyn.diagnose.task import KEPT, Task
from urdyn.diagnose.wire import SERIES
from urdyn.io import write_text
from urdyn.signal import Instant
from urdyn.types import Array


class Desk:
    """A task at work."""

    def __init__(self, task: Task) -> None:
        self.task, self.diagnosis = task, Diagnosis(task.fit, task.period, task.rules)
        kept = task.folder / KEPT.format(index=task.index)
        start = memory.load(task.identity, kept) if task.index else self.diagnosis.init()
        self._state: State = start

    def take(self, numbers: Array) -> list[Finding]:
        """Some instants on, as `wire` has them; what is new or worse."""
        found: list[Finding] = []
        for now in _instants(numbers.reshape(-1, 1 + SERIES * self.diagnosis.space.joints)):
            self._state, more = self.diagnosis.step(self._state, now)
            found += more
        return found

    def finish(self) -> list[Finding]:
        """The stream has ended: what the last rows tell."""
        self._state, found = self.diagnosis.finish(self._state)
        forget_gone(self.task.folder, self.diagnosis.findings(self._state))
        return found

    def keep(self, index: int) -> None:
        """Remember this sample, and the one before until the run has been kept as well."""
        folder = self.task.folder
        path = folder / KEPT.format(index=index)
        # A killed run may have left one of this very sample, and goes on at the one before.
        others = set(folder.glob(KEPT.format(index="*"))) - {path}
        memory.save(self._state, self.task.identity, path)
        for stray in sorted(others, key=lambda p: p.stat().st_mtime)[:-1]:
            stray.unlink()

    def write(self) -> dict[str, Any]:
        """Bring DIR/findings.json up to date; what it says."""
        task, known = self.task, acknowledged(self.task.folder)
        now = self.diagnosis.findings(self._state)
        findings = [replace(f, acknowledged=known.quiets(f)) for f in now]
        observability = self.diagnosis.observable(self._state)
        document = findings_document(
            findings,
            joints=task.fit.dynamics.arm.joint_names,
            judged=self.diagnosis.judged(self._state),
            observability=observability,
            identity=task.identity,
            source=task.source,
            costs=task.rules.costs,
        )
        write_text(task.folder / FOUND, json.dumps(document, indent=2) + "\n")
        return document

    def untold(self, found: Sequence[Finding]) -> list[dict[str, Any]]:
        """Those of what was found that nobody has seen yet."""
        known = acknowledged(self.task.folder)
        return [finding.plain() for finding in found if not known.quiets(finding)]


def _instants(rows: Array) -> list[Now]:
    """Rows (N, 1 + 10 J) as a tracker had them."""
    series = rows[:, 1:].reshape(len(rows), SERIES, -1)
    pairs = zip(rows[:, 0].tolist(), series, strict=True)
    return [Now(Instant(t, *of[:-2]), *of[-2:]) for t, of in pairs]
