"""The book of findings: what is new is entered, and what is known by name goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from urdyn.diagnose import zero
from urdyn.diagnose.event import Event
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.lossy import of_the_stream
from urdyn.diagnose.rules import Rules
from urdyn.diagnose.space import Space
from urdyn.diagnose.trust import in_company
from urdyn.diagnose.verdict import of_event, worse

Findings = tuple[Finding, ...]


def finding_of(event: Event, book: Findings, space: Space, rules: Rules) -> Finding:
    """An event as a finding; of one that is in the book and goes on, since it began."""
    finding = of_event(event, space, rules)
    old = next((f for f in book if f.id == finding.id), None)
    if old is None:
        return finding
    if "jump_rad" in event.evidence:
        event = zero.beside(event, old, rules.levels(event.kind))
    if _goes_on(old, event.onset):
        event = replace(event, onset=old.onset_s)
    return of_event(event, space, rules)


def entered(book: Findings, new: Sequence[Finding]) -> tuple[Findings, list[Finding]]:
    """The book with new findings, and those as it has them.

    One of a known name is replaced, and keeps its alarm. What shows again, as a sensor that was
    stuck while its joint stood, began when it did first.
    """
    if not new:
        return book, []
    findings = {finding.id: finding for finding in book}
    for finding in new:
        if finding.id in findings:
            old = findings[finding.id]
            first = old if _goes_on(old, finding.onset_s) else finding
            finding = replace(
                finding,
                onset_s=first.onset_s,
                onset_interval_s=first.onset_interval_s,
                alarm_s=old.alarm_s,
                acknowledged=old.acknowledged,
            )
        findings[finding.id] = finding
    told = tuple(of_the_stream(in_company(tuple(findings.values()))))
    ids = {finding.id for finding in new}
    return told, [finding for finding in told if finding.id in ids]


def to_be_told(before: Findings, found: Sequence[Finding]) -> list[Finding]:
    """Those of what was found that were not in the book before, or are graver by now."""
    known = {finding.id: finding for finding in before}
    return [f for f in found if f.id not in known or worse(known[f.id], f)]


def _goes_on(old: Finding, onset: float) -> bool:
    """Whether what shows [s] after a finding was told is that finding: it began when it did."""
    return onset > old.alarm_s
