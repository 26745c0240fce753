"""A diagnosis that runs while a twin is tracked, and keeps DIR/findings.json up to date."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from urdyn.diagnose.job import KEPT, Job
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.reading_row import blank, row
from urdyn.errors import InputError
from urdyn.identify.fit import Fit
from urdyn.io.frames import Words, numbers_frame, words_frame, words_of
from urdyn.io.helper import Helper
from urdyn.twin import document
from urdyn.types import Array, Mask

if TYPE_CHECKING:
    from urdyn.tracking import Reading

BATCH = 0.05  # [s] of instants sent at once
WAITING = 1 << 24  # [bytes] most that wait to be diagnosed: a minute of 500 Hz
BEHIND = (
    "the diagnosis is far behind and leaves out what comes until it has caught up; it needs more "
    "of this computer, or fewer samples by --rate"
)

Tell = Callable[[Mapping[str, Any]], None]


def begin_diagnosis(fit: Fit) -> Helper:
    """The process that diagnoses an arm; begun ahead, it is ready when a stream is."""
    advice = "run again, or with --no-diagnosis"
    helper = Helper("urdyn.diagnose.worker", "the diagnosis", advice)
    helper.send(words_frame(document(fit)))
    return helper


class Onlooker:
    """An `Observer` of tracking; `tell` is called with each new or changed finding.

    `retract` is called with those retracted, as they were reported, and `warn` with a new doubt
    about all of them.

    It works in a process of its own, so that sampling shares nothing with it but the machine.
    """

    def __init__(
        self,
        fit: Fit,
        period: float,
        rules: Rules,
        source: Mapping[str, str],
        tell: Tell | None = None,
        helper: Helper | None = None,
        retract: Tell | None = None,
        warn: Callable[[str], None] | None = None,
        live: bool = False,
    ) -> None:
        """`helper` is what `begin_diagnosis` returned for this fit, if begun ahead.

        Args:
            live: never wait for the diagnosis: where it is far behind, it has a gap.
        """
        self.fit, self.period, self.rules, self.source = fit, period, rules, source
        self.tell, self.retract, self.warn, self.live = tell, retract, warn, live
        self.findings: tuple[Mapping[str, Any], ...] = ()
        self.doubt = ""
        self._folder, self._rows = Path(), list[Array]()
        self._batch = max(1, round(BATCH / period))
        self._helper = helper
        self._begun, self._finished = False, None
        self._behind = False  # and leaves out what comes
        self._keeping = self._kept = -1  # samples
        self._noted = {"restarts": 0, "load_as_set": False}

    def begin(self, folder: Path, index: int, identity: Mapping[str, str]) -> None:
        """Learn where the run is kept, and from which sample it goes on."""
        rules = hashlib.sha256(repr(self.rules).encode()).hexdigest()
        self._folder = folder
        path = folder / KEPT.format(index=index)
        if not index:
            self.forget()
        elif not path.exists():
            raise InputError(f"{path}: is missing, and the run cannot go on; begin with --fresh")
        whose = dict(identity) | {"rules": rules}
        job = Job(self.fit, self.period, self.rules, folder, index, whose, self.source)
        self._helper = self._helper or begin_diagnosis(self.fit)
        self._helper.await_ready()
        self._helper.send(words_frame(job.plain()))
        while index and not self._begun:  # can it resume from what was kept?
            self._listen()

    def take(self, reading: Reading) -> None:
        """One instant on."""
        self._add(row(reading))

    def miss(self, t: float, silent: Mask, current: Array) -> None:
        """An instant without these joints' angles: is it an encoder's fault?"""
        if np.count_nonzero(silent):
            self._add(blank(t, silent, current))

    def note(self, restarts: int, load_as_set: bool) -> None:
        """What no instant contains; sent to the diagnosis where it is new."""
        noted = {"restarts": restarts, "load_as_set": load_as_set}
        if noted != self._noted:
            self._noted = noted
            self._there.send(words_frame({"note": noted}))

    def keep(self, index: int) -> None:
        """Keep this sample, and the one before until the run has been kept as well."""
        self._pass_on()
        self._keeping, self._kept = index, -1  # even where this sample has been kept before
        self._there.send(words_frame({"keep": index}))

    def kept(self, wait: bool) -> bool:
        """Whether the last sample to be kept is on disk."""
        while self._kept != self._keeping and (wait or self._there.failed):
            self._listen()
        return self._kept == self._keeping

    def finish(self) -> Mapping[str, Any]:
        """Send the last rows; return what was found."""
        self._pass_on()
        self._there.send(words_frame({"finish": True}))
        while self._finished is None:
            self._listen()
        return self._finished

    def forget(self) -> None:
        """Remove what was kept: the run is over for good."""
        for path in self._folder.glob(KEPT.format(index="*")):
            path.unlink()

    def close(self) -> None:
        """Stop, however the run has ended."""
        if self._helper:
            self._helper.close()

    @property
    def _there(self) -> Helper:
        assert self._helper is not None, "begin first"
        return self._helper

    def _add(self, numbers: Array) -> None:
        """Add a row, which waits for the others of its batch."""
        self._rows.append(numbers)
        if len(self._rows) >= self._batch:
            self._pass_on()

    def _pass_on(self) -> None:
        """Send the waiting rows.

        Where the diagnosis is far behind, a recording waits for it. Of a robot all is left out
        until it has caught up: one gap, as if the robot had been away, instead of many.
        """
        there = self._there
        self._hear(there.exchange())
        while not self.live and there.waiting > WAITING and not there.failed:
            self._hear(there.exchange(None))
        before, self._behind = self._behind, there.waiting > (0 if self._behind else WAITING)
        if self.warn and self._behind and not before:
            self.warn(BEHIND)
        if self._rows and not self._behind:
            there.send(numbers_frame(np.array(self._rows)))
        self._rows = []

    def _listen(self) -> None:
        self._hear(self._there.listen())

    def _hear(self, heard: list[Words | Array]) -> None:
        for words in map(words_of, heard):
            before, self.findings = self.findings, tuple(words.get("findings", self.findings))
            doubted, self.doubt = self.doubt, words.get("doubt", self.doubt)
            self._begun = True
            self._kept = words.get("kept", self._kept)
            self._finished = words.get("finished")
            if self.warn and self.doubt not in ("", doubted):
                self.warn(self.doubt)
            if self.tell:
                for finding in words.get("told", ()):
                    self.tell(finding)
            if self.retract:
                left = {finding["id"] for finding in self.findings}
                for finding in before:
                    if finding["id"] not in left:
                        self.retract(finding)
