"""A diagnosis that looks on while a twin is tracked, and keeps DIR/findings.json up to date."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from queue import Queue
from threading import Thread
from typing import Any

from urdyn.diagnose import memory
from urdyn.diagnose.acknowledge import acknowledged
from urdyn.diagnose.diagnosis import Diagnosis, Now, State
from urdyn.diagnose.document import findings_document
from urdyn.diagnose.finding import Finding
from urdyn.errors import InputError
from urdyn.io import write_text
from urdyn.tracking import Reading

FILE = "findings.json"
WAITING = 5000  # instants that wait to be diagnosed, at most
SWITCH = 5e-4  # [s] after which the thread that tracks may go on
TOLD = ("findings", "joints", "recommendation", "observability")  # in a run's summary, too
KEPT = "diagnosis-{index}.npz"

Tell = Callable[[Finding], None]


class Onlooker:
    """An `Observer` of tracking; `tell` hears of every finding that is new or has changed.

    It works in a thread of its own, so that a sample never waits for a diagnosis.
    """

    def __init__(
        self, diagnosis: Diagnosis, source: Mapping[str, str], tell: Tell | None = None
    ) -> None:
        self.diagnosis, self.source, self.tell = diagnosis, source, tell
        self.state: State = diagnosis.init()
        self.findings: tuple[Mapping[str, Any], ...] = ()
        self._identity: dict[str, str] = {}
        self._folder = Path()
        self._inbox: Queue[Now | None] = Queue(WAITING)
        self._failed: Exception | None = None

    def begin(self, folder: Path, index: int, identity: Mapping[str, str]) -> None:
        """Where the run is kept, and from which sample it goes on."""
        rules = hashlib.sha256(repr(self.diagnosis.rules).encode()).hexdigest()
        self._folder, self._identity = folder, dict(identity) | {"rules": rules}
        path = folder / KEPT.format(index=index)
        if not index:
            self.forget()
        elif not path.exists():
            raise InputError(f"{path}: is missing, and the run cannot go on; begin with --fresh")
        else:
            self.state = memory.load(self._identity, path)
        self._write()
        sys.setswitchinterval(SWITCH)
        Thread(target=self._work, daemon=True).start()

    def take(self, reading: Reading) -> None:
        """One instant on."""
        self._inbox.put(Now(reading.instant, reading.inputs.s, reading.travelled))

    def keep(self, index: int) -> None:
        """Remember this sample, and the one before until the run has been kept as well."""
        self._wait()
        self._write()
        path = self._folder / KEPT.format(index=index)
        older = sorted(self._folder.glob(KEPT.format(index="*")), key=lambda p: p.stat().st_mtime)
        memory.save(self.state, self._identity, path)
        for stray in older[:-1]:
            if stray != path:
                stray.unlink()

    def finish(self) -> Mapping[str, Any]:
        """The last rows, and what was found."""
        self._wait()
        self._inbox.put(None)
        self.state, found = self.diagnosis.finish(self.state)
        self._tell(found)
        document = self._write()
        return {name: document[name] for name in TOLD}

    def forget(self) -> None:
        """Remove what was remembered: the run is over for good."""
        for path in self._folder.glob(KEPT.format(index="*")):
            path.unlink()

    def _work(self) -> None:
        """Instant after instant, until there is none."""
        while (now := self._inbox.get()) is not None:
            try:
                if not self._failed:
                    self.state, found = self.diagnosis.step(self.state, now)
                    self._tell(found)
            except Exception as error:  # it is raised where the run can be ended in good order
                self._failed = error
            self._inbox.task_done()
        self._inbox.task_done()

    def _wait(self) -> None:
        """Until all that was taken is diagnosed."""
        self._inbox.join()
        if self._failed:
            raise self._failed

    def _tell(self, found: list[Finding]) -> None:
        if not found:
            return
        self._write()
        known = acknowledged(self._folder)
        for finding in found:
            if self.tell and not known.quiets(finding):
                self.tell(finding)

    def _write(self) -> dict[str, Any]:
        known = acknowledged(self._folder)
        now = self.diagnosis.findings(self.state)
        findings = [replace(f, acknowledged=known.quiets(f)) for f in now]
        observability = self.diagnosis.observable(self.state)
        of, costs = self._identity, self.diagnosis.rules.costs
        joints = self.diagnosis.fit.dynamics.arm.joint_names
        document = findings_document(findings, joints, observability, of, self.source, costs)
        self.findings = tuple(document["findings"])
        write_text(self._folder / FILE, json.dumps(document, indent=2) + "\n")
        return document
