"""Sensors of many joints that fall silent together: the stream has lost their values.

A sensor, or its cable, fails alone. If values of more joints than fail at once are missing, or of
several from the same row on, the cause is what they have in common: the recorder, or the network.
None of them needs service for that, nor does one of which a run has held no value at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from urdyn.diagnose.findings.trust import AT_ONCE, PAIR
from urdyn.diagnose.kinds.evidence import Evidence
from urdyn.diagnose.kinds.finding import Finding

ADVICE = "look at the recorder and the network: sensors of {} joints do not fall silent at once"
LACKING = "look at the recorder: it has no current of this joint at all"


def silent(kind: str, evidence: Mapping[str, Any]) -> bool:
    """Whether a finding is of a sensor that gives, or gave, no values."""
    return kind == "sensor_fault" and Evidence(evidence).silent


def of_the_stream(findings: Sequence[Finding]) -> list[Finding]:
    """Findings, with silences of the stream, not of a sensor, reduced to warnings."""
    silences = [f for f in findings if silent(f.kind, f.evidence)]
    spans = {f.id: _span(f) for f in silences}
    told = []
    for finding in findings:
        if begin_end := spans.get(finding.id):
            begin, end = begin_end[0] - AT_ONCE, begin_end[1] + AT_ONCE
            near = (f for f in silences if spans[f.id][0] < end and begin < spans[f.id][1])
            if (joints := len({f.joint for f in near})) > PAIR or finding.says.at_once > 1:
                many = ADVICE.format(max(joints, finding.says.at_once))
                finding = replace(finding, severity="warning", advice=many)
            elif not finding.says.ever_heard:
                finding = replace(finding, severity="warning", advice=LACKING)
        told.append(finding)
    return told


def _span(finding: Finding) -> tuple[float, float]:
    """From its first alarm to its last known time [s]."""
    says, first = finding.says, finding.alarm_s
    return first, max(first, says.anew or 0.0, says.until or 0.0)
