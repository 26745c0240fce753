"""The book of findings: new ones are entered, known ones are updated under their names.

A finding that a joint's backlash or another change explains is removed again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from urdyn.diagnose.fast import encoder_zero
from urdyn.diagnose.fast.recurring import Recurred, unjolted
from urdyn.diagnose.findings.event_finding import of_event
from urdyn.diagnose.findings.explained import timed, unexplained
from urdyn.diagnose.findings.external_pull import of_a_pull
from urdyn.diagnose.findings.lossy_stream import of_the_stream
from urdyn.diagnose.findings.trust import in_company
from urdyn.diagnose.findings.verdict import (
    apart,
    grown,
    identity,
    of_change,
    risen,
    up_to_date,
    worse,
)
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import JUMPS, Rules
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.slow.judge import Judge
from urdyn.diagnose.slow.recall import Level
from urdyn.diagnose.slow.slow_state import SlowState

SERIES = 400  # blocks kept of a found change, from all the time since
RECENT = 48  # the last of them, all kept; older ones are thinned

Findings = tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class Book:
    """What was found."""

    findings: Findings = ()  # as last reported
    # Course of the slow ones, by suspect.
    series: Mapping[int, tuple[Level, ...]] = field(default_factory=dict)
    upto: float = np.nan  # [s] end of the last block processed


@dataclass(frozen=True, eq=False)
class Ledger:
    """Enters the tests' results in a book, and reports which are new or worse."""

    space: Space
    rules: Rules
    judge: Judge

    def events(self, book: Book, events: Iterable[Event]) -> tuple[Book, list[Finding]]:
        """Add events; one that merely goes on is reported again where it is graver by now."""
        after, told = book.findings, set[str]()
        for event in events:  # one by one: a zero may jump there and back within a beat
            finding = finding_of(event, after, self.space, self.rules)
            after, _ = entered(after, [finding])
            told.add(finding.id)
        after = unexplained(after)
        found = [finding for finding in after if finding.id in told]
        return replace(book, findings=after), to_be_told(book.findings, found)

    def unjolted(self, book: Book, seen: Recurred) -> Book:
        """Remove pushes that are a joint's backlash."""
        coulomb = self.space.reference.drive.coulomb
        return replace(book, findings=unjolted(book.findings, seen, coulomb))

    def changes(self, book: Book, slow: SlowState) -> tuple[Book, list[Finding]]:
        """Add new changes, and update the known ones."""
        book, found = self._new(self._withdrawn(book, slow), slow)
        if slow.bank.t == book.upto or np.isnan(slow.bank.t):
            return book, found
        book = self._gone_on(book, slow)
        grown = risen(book.findings, self.now(book, slow))
        findings, more = entered(book.findings, grown)
        return replace(book, findings=findings), found + more

    def closed(self, book: Book, slow: SlowState) -> tuple[Book, SlowState]:
        """Without the course of what is gone: its finding stays, and what comes back is another."""
        gone = {finding.id for finding in book.findings if finding.gone}
        of = self.judge.of.each
        over = {k for k in slow.suspects if identity(of[k], self.space) in gone}
        if not over:
            return book, slow
        series = {k: levels for k, levels in book.series.items() if k not in over}
        return replace(book, series=series), self.judge.without(slow, over)

    def now(self, book: Book, slow: SlowState) -> list[Finding]:
        """All findings, up to date."""
        known = {k: self.judge.of.each[k] for k in slow.suspects}
        extent = self.judge.extent
        told = up_to_date(
            book.findings, known, book.series, self.space, book.upto, extent.strays(slow)
        )
        return of_a_pull(apart(told, known, extent.terms(slow), self.space))

    def _new(self, book: Book, slow: SlowState) -> tuple[Book, list[Finding]]:
        """Add the changes that this step has settled."""
        series, new, extent = dict(book.series), [], self.judge.extent
        for change in slow.found:
            k, suspect = change.suspect, self.judge.of.each[change.suspect]
            if not suspect.kind.of_tool and k not in slow.suspects:
                continue
            change = timed(change, suspect.joint, book.findings)
            trace = () if suspect.kind.of_tool else tuple(extent.trace(slow, k))
            series[k] = trace
            finding = of_change(change, self.judge.of, self.space, self.rules, trace)
            if trace:  # sized and forecast as it will be from the next block on
                finding = grown(finding, suspect, trace, change.alarm, extent.strays(slow)[k])
            new.append(finding)
        findings, found = entered(book.findings, new)
        return replace(book, series=series, findings=unexplained(findings)), found

    def _gone_on(self, book: Book, slow: SlowState) -> Book:
        """Add the last block of every known change."""
        series = dict(book.series)
        for k, level in self.judge.extent.levels(slow).items():
            had = series.get(k, ())
            if not had or level[0] > had[-1][0]:  # a trace includes the last block
                series[k] = thinned((*had, level))
        return replace(book, series=series, upto=slow.bank.t)

    def _withdrawn(self, book: Book, slow: SlowState) -> Book:
        """Remove findings of which nothing is left since another one explains them."""
        of = self.judge.of.each
        gone = {k for k in book.series if not of[k].kind.of_tool and k not in slow.suspects}
        if not gone:
            return book
        ids = {identity(of[k], self.space) for k in gone}
        series = {k: levels for k, levels in book.series.items() if k not in gone}
        return replace(
            book, series=series, findings=tuple(f for f in book.findings if f.id not in ids)
        )


def thinned(series: tuple[Level, ...]) -> tuple[Level, ...]:
    """Drop the oldest of the levels with the closest neighbours, where there are too many."""
    if len(series) <= SERIES:
        return series
    t = np.array([level[0] for level in series[:-RECENT]])
    k = int(np.argmin(np.round(t[2:] - t[:-2]))) + 1
    return series[:k] + series[k + 1 :]


def finding_of(event: Event, book: Findings, space: Space, rules: Rules) -> Finding:
    """An event as a finding; one that continues a finding in the book keeps when that began."""
    finding = of_event(event, space, rules)
    old = next((f for f in book if f.id == finding.id), None)
    if old is None:
        return finding
    if event.kind == JUMPS:
        event = encoder_zero.beside(event, old, rules.jump)
    if _goes_on(old, event.onset):
        first, last = old.onset_interval_s
        event = replace(event, onset=old.onset_s, within=last - old.onset_s, unseen=first)
    return of_event(event, space, rules)


def entered(book: Findings, new: Sequence[Finding]) -> tuple[Findings, list[Finding]]:
    """The book with new findings, and those as entered, with others whose severity they change.

    One of a known name is replaced, and keeps its alarm, unless it was gone. One that shows again,
    such as a sensor stuck while its joint stood still, keeps its first onset.
    """
    if not new:
        return book, []
    findings = {finding.id: finding for finding in book}
    for finding in new:
        old = findings.get(finding.id)
        if old and not old.gone:
            first = old if _goes_on(old, finding.onset_s) else finding
            finding = replace(
                finding,
                onset_s=first.onset_s,
                onset_interval_s=first.onset_interval_s,
                pause_s=first.pause_s,
                alarm_s=old.alarm_s,
            )
        findings[finding.id] = finding
    told = tuple(of_a_pull(of_the_stream(in_company(tuple(findings.values())))))
    ids, before = {finding.id for finding in new}, {old.id: old.severity for old in book}
    return told, [f for f in told if f.id in ids or f.severity != before[f.id]]


def to_be_told(before: Findings, found: Sequence[Finding]) -> list[Finding]:
    """The findings that were not in the book before, or have changed enough since."""
    known = {finding.id: finding for finding in before}
    return [f for f in found if f.id not in known or worse(known[f.id], f)]


def _goes_on(old: Finding, onset: float) -> bool:
    """Whether an onset [s] is after that of a finding, and so continues it."""
    return onset > old.onset_interval_s[1]
