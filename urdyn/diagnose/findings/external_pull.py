"""A current sensor that goes wrong beside another, a drive or a zero: rather, something pulls.

A sensor fails alone, and in one way. What pulls at an arm, a hose or a cable, is a torque of
several joints that depends on the pose. No kind is that: biases, gains and zeros of the joints
that bear most of it come nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from urdyn.diagnose.findings.trust import AT_ONCE
from urdyn.diagnose.kinds.finding import Finding
from urdyn.io.run_folder import SEVERITIES

SENSOR = "sensor_fault"
NEAREST = (SENSOR, "encoder_offset", "health_degradation")
ADVICE = (
    "see whether a hose or a cable pulls at the arm, or it works in contact: a current sensor "
    "fails alone, and in one way"
)


def of_a_pull(findings: Sequence[Finding]) -> list[Finding]:
    """Findings, with slow ones reduced to warnings without a service where a pull is likelier."""
    slow = [f for f in findings if f.kind in NEAREST and f.says.slow and not f.gone]
    sensors = [f for f in slow if f.kind == SENSOR]
    pulled = set[str]()
    for finding in slow:
        others = slow if finding.kind == SENSOR else sensors
        if any(f.id != finding.id and abs(f.alarm_s - finding.alarm_s) < AT_ONCE for f in others):
            pulled.add(finding.id)
    return [_reduced(f) if f.id in pulled else f for f in findings]


def _reduced(finding: Finding) -> Finding:
    severity = min(finding.severity, "warning", key=SEVERITIES.index)
    return replace(finding, severity=severity, advice=ADVICE, time_to_failure_s=None, forecast=None)
