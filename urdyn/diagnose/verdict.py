"""Findings out of what the tests have seen, in words and numbers that a plant uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from urdyn.diagnose.change import Change
from urdyn.diagnose.event import Event
from urdyn.diagnose.explain import NOBODY, Suspect, Suspects
from urdyn.diagnose.finding import Finding, severity
from urdyn.diagnose.prognosis import time_left, trend
from urdyn.diagnose.rules import Rules
from urdyn.diagnose.space import Space

Series = Sequence[tuple[float, float, float]]
WORSE = 0.25  # [-] of its size by which a finding has to change to be told again
SURELY = 0.999  # [-] more confidence than this no test has earned


def of_change(change: Change, of: Suspects, space: Space, trace: Series) -> Finding:
    """A slow change."""
    suspect = of.each[change.suspect]
    kind, j = suspect.kind, suspect.joint
    scale = suspect.unit
    size, sd = change.size / scale, change.size_sd / scale
    rate, rate_sd = change.rate / scale, change.rate_sd / scale
    left = time_left(size, sd, rate, rate_sd, kind.critical) if change.rate else None
    evidence: dict[str, Any] = {
        "statistic": "log-likelihood ratio beside the healthy arm, over onsets and shapes",
        "nats": None if np.isnan(change.evidence) else change.evidence,
        "rate_per_s": rate,
        "rate_sd": rate_sd,
        "rivals": [
            {"kind": of.each[k].kind.name, "joint": _joint(of.each[k]), "share": share}
            for k, share in change.rivals
        ],
        "series": _series(trace, scale),
    }
    if change.detail:
        evidence |= _payload(change.detail)
    name = "tool" if j == NOBODY else space.reference.arm.joint_names[j]
    onset = change.onset
    text = _said(kind.quantity, kind.unit, name, size, sd, onset)
    return Finding(
        id=f"{kind.name}.{name}" + (f"@{onset:.1f}" if kind.of_tool else ""),
        kind=kind.name,
        joint=_joint(suspect),
        name=name,
        onset_s=onset,
        onset_interval_s=(change.onset_lo, change.onset_hi),
        alarm_s=change.alarm,
        severity=severity(size, kind.warning, kind.critical),
        confidence=min(change.confidence, SURELY),
        time_to_failure_s=left,
        size=size,
        size_sd=sd,
        quantity=kind.quantity,
        unit=kind.unit,
        text=text,
        advice=kind.advice,
        evidence=evidence,
    )


def of_event(event: Event, space: Space, rules: Rules) -> Finding:
    """A fast kind."""
    levels = rules.fast.get(event.kind) or {}
    if event.kind == "sensor_fault":
        levels = {"warning": 0.0, "critical": 1.0, "quantity": "current sensor", "unit": "-"}
        levels |= {"advice": "check the current sensor of this joint"}
    arm = space.reference.arm
    names = arm.link_names if event.kind == "collision" else arm.joint_names
    name = names[event.joint]
    once = event.kind == "collision"
    return Finding(
        id=f"{event.kind}.{name}" + (f"@{event.onset:.1f}" if once else ""),
        kind=event.kind,
        joint=event.joint,
        name=name,
        onset_s=event.onset,
        onset_interval_s=(event.onset - 0.1, event.onset + 0.1),
        alarm_s=event.alarm,
        severity=severity(event.size, levels["warning"], levels["critical"]),
        confidence=min(event.confidence, SURELY),
        time_to_failure_s=None,
        size=event.size,
        size_sd=float("nan"),
        quantity=levels["quantity"],
        unit=levels["unit"],
        text=_shown(event, name),
        advice=levels["advice"],
        evidence=event.evidence,
    )


def risen(
    findings: Sequence[Finding],
    known: Mapping[int, Suspect],
    series: Mapping[int, Series],
    space: Space,
) -> list[Finding]:
    """Slow findings that have changed enough to be told again."""
    told = []
    for k, suspect in known.items():
        kind = suspect.kind
        name = space.reference.arm.joint_names[suspect.joint]
        old = next((f for f in findings if f.id == f"{kind.name}.{name}"), None)
        if old is None or not series.get(k):
            continue
        scale = suspect.unit
        _, size, sd = (x / scale for x in series[k][-1])
        level = severity(size, kind.warning, kind.critical)
        if level == old.severity and abs(size - old.size) < WORSE * abs(old.size) + 2.0 * sd:
            continue
        end, end_sd, rate, rate_sd = (x / scale for x in trend(series[k], old.onset_s))
        told.append(
            replace(
                old,
                size=size,
                size_sd=sd,
                severity=level,
                time_to_failure_s=time_left(end, end_sd, rate, rate_sd, kind.critical),
                text=_said(kind.quantity, kind.unit, name, size, sd, old.onset_s),
                evidence=dict(old.evidence) | {"series": _series(series[k], scale)},
                acknowledged=False,
            )
        )
    return told


def _joint(suspect: Suspect) -> int | None:
    return None if suspect.joint == NOBODY else suspect.joint


def _payload(inertials: Sequence[float]) -> dict[str, Any]:
    mass = inertials[0]
    centre = [x / mass for x in inertials[1:4]] if mass else [0.0, 0.0, 0.0]
    return {"mass_kg": mass, "com_m": centre}


def _series(trace: Series, scale: float) -> dict[str, list[float]]:
    return {
        "t": [row[0] for row in trace],
        "size": [row[1] / scale for row in trace],
        "sd": [row[2] / scale for row in trace],
    }


def _said(quantity: str, unit: str, name: str, size: float, sd: float, onset: float) -> str:
    if unit == "-":
        much, unsure = f"{100 * size:+.1f} %", f"{100 * sd:.1f} %"
    else:
        much, unsure = f"{size:+.3g} {unit}", f"{sd:.2g}"
    return f"{name}: {quantity} {much} ± {unsure} since {onset:.1f} s"


def _shown(event: Event, name: str) -> str:
    told = event.evidence
    match event.kind:
        case "collision":
            along = ", ".join(f"{x:.0f}" for x in told["force_N"])
            return (
                f"{name}: pushed with {told['strength_N']:.0f} N, ({along}) N along x, y, z of the "
                f"base, for {told['duration_s']:.2f} s at {event.onset:.2f} s"
            )
        case "controller_instability":
            how = "growing" if told["growing"] else "steady"
            rings = f"{told['frequency_Hz']:.1f} Hz with {told['amplitude_Nm']:.2f} N·m, {how}"
            return f"{name}: swings at {rings}, since {event.onset:.1f} s"
        case "joint_backlash":
            gap = 1e3 * told["half_gap_rad"]
            seen = f"seen in {told['reversals']} reversals of load"
            return f"{name}: a gap of ± {gap:.2g} mrad, {seen}"
    return f"{name}: current sensor is {told['mode']} since {event.onset:.1f} s"
