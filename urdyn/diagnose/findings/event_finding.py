"""Findings of fast kinds, in a plant's words and numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urdyn.diagnose.findings.trust import trust
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.evidence import CLIPPED, ENCODER
from urdyn.diagnose.kinds.fast_rules import Levels
from urdyn.diagnose.kinds.finding import Finding, severity
from urdyn.diagnose.kinds.rules import Rules
from urdyn.diagnose.residual.space import Space
from urdyn.report.digits import interval90
from urdyn.report.finding_words import SHOWS, direction


def of_event(event: Event, space: Space, rules: Rules) -> Finding:
    """The finding of a fast kind's event."""
    levels = _levels(event, rules)
    arm = space.reference.arm
    names = arm.link_names if event.kind == "collision" else arm.joint_names
    name = names[event.joint]
    once = event.kind == "collision"
    return Finding(
        id=f"{event.kind}.{name}" + (f"@{event.onset:.1f}" if once else _which(event)),
        kind=event.kind,
        joint=event.joint,
        name=name,
        onset_s=event.onset,
        onset_interval_s=event.began,
        alarm_s=event.alarm,
        severity=severity(event.size, levels.warning, levels.critical),
        confidence=event.confidence * trust(event.kind, rules.named),
        time_to_failure_s=None,
        size=event.size,
        size_sd=event.size_sd,
        quantity=levels.quantity,
        unit=levels.unit,
        text=_shown(event, name),
        advice=levels.advice,
        evidence=event.evidence,
    )


def _levels(event: Event, rules: Rules) -> Levels:
    """Levels of its kind; for a sensor's fault, present or past, by which sensor it is."""
    sensor = _sensor(event)
    if event.kind == "sensor_fault":
        advice = f"check the {sensor} of this joint"
        levels = Levels(warning=0.0, critical=1.0, quantity=sensor, unit="-", advice=advice)
    else:
        levels = rules.levels(event.kind)
    if event.says.recurs_at == "velocity":  # another friction at slow reversals looks alike
        which = "by brisk motion (urdyn excite --kind probe), see whether it is a gap or friction"
        return replace(levels, critical=np.inf, advice=f"{which}; then {levels.advice}")
    if event.says.until is None and not event.says.to_and_fro:
        return levels
    loose = f"look for a loose contact at the {sensor} of this joint"
    return replace(levels, warning=0.0, advice=loose)


def _which(event: Event) -> str:
    """Suffix for a joint's encoder, whose faults are distinct from its current sensor's."""
    return f".{ENCODER}" if event.kind == "sensor_fault" and _sensor(event) == ENCODER else ""


def _sensor(event: Event) -> str:
    """Which of a joint's sensors is at fault."""
    return ENCODER if event.says.of_encoder else "current sensor"


def _shown(event: Event, name: str) -> str:
    match event.kind:
        case "collision":
            return _pushed(event, name)
        case "controller_instability":
            return _swings(event, name)
        case "joint_backlash":
            return _loose(event, name)
        case "encoder_offset":
            return _jumped(event, name)
    return _sick(event, name)


def _pushed(event: Event, name: str) -> str:
    told = event.evidence
    lasted = f"for {told['duration_s']:.2f} s at stamp {event.onset:.2f} s"
    strength = interval90(event.size, event.size_sd)
    return f"{name}: pushed with {strength} N, {direction(told)}, {lasted}"


def _swings(event: Event, name: str) -> str:
    told, says = event.evidence, event.says
    how = "growing" if says.growing else "fading" if says.fading else "steady"
    rings = f"{told['frequency_Hz']:.1f} Hz with {told['amplitude_Nm']:.2f} N·m, {how}"
    return f"{name}: swings at {rings}, since stamp {event.onset:.1f} s"


def _loose(event: Event, name: str) -> str:
    told, reversals = event.evidence, event.says.recurs_at
    if reversals is None:
        seen = f"seen in {told['reversals']} reversals of load"
        return f"{name}: a gap of ± {1e3 * told['half_gap_rad']:.2g} mrad, {seen}"
    at = f"{told['reversals']} reversals of {reversals}"
    jolt = f"a jolt of {told['lasting_s']:.2f} s recurs in {at}"
    about = float(f"{1e3 * event.size:.1g}")
    return f"{name}: {jolt}, as of a gap of about ± {about:g} mrad"


def _jumped(event: Event, name: str) -> str:
    until = event.says.until
    if event.says.to_and_fro:
        how = f"jumps to and fro by {abs(event.size):.3g} rad"
        return f"{name}: the encoder's angle {how}, since stamp {event.onset:.2f} s"
    if until is None:
        jump = f"jumped by {event.size:+.3g} rad at stamp {event.onset:.2f} s"
        return f"{name}: zero of the encoder {jump}"
    span = _while(event.onset, until)
    return f"{name}: zero of the encoder was off by {event.evidence['was_rad']:+.3g} rad {span}"


def _sick(event: Event, name: str) -> str:
    told, says, sensor = event.evidence, event.says, _sensor(event)
    how = SHOWS.get(told["mode"], told["mode"])
    if says.until is not None:
        often = ""
        if says.times > 1:
            often = f" {says.times} times, for {told['longest_s']:.1f} s at most,"
        span = _while(event.onset, says.until)
        return f"{name}: {sensor} was {how}{often} {span}, and is well since"
    at = f" at {told['value_A']:.3g} A" if "value_A" in told else ""
    if told["mode"] == CLIPPED:
        return f"{name}: {sensor} clips{at}, since stamp {event.onset:.1f} s"
    if says.times > 1:
        before = f", and was before, since stamp {event.onset:.1f} s"
        return f"{name}: {sensor} is {how} since stamp {says.anew:.1f} s{before}"
    return f"{name}: {sensor} is {how}{at} since stamp {event.onset:.1f} s"


def _while(begin: float, end: float) -> str:
    """From when to when; a single time where both are equal."""
    first, last = f"{begin:.2f}", f"{end:.2f}"
    return f"at stamp {first} s" if first == last else f"from stamp {first} s to {last} s"
