"""Findings of slow changes, in a plant's words and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from urdyn.diagnose.findings.prognosis import Course, trend
from urdyn.diagnose.findings.trust import trust
from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.finding import Finding, severity
from urdyn.diagnose.kinds.rules import JUMPS, Rules, SlowKind
from urdyn.diagnose.kinds.suspects import Suspect, Suspects
from urdyn.diagnose.residual.space import Space
from urdyn.diagnose.slow.recall import Series
from urdyn.io.run_folder import SEVERITIES
from urdyn.model.body import centre_of_mass
from urdyn.types import NORMAL90

WORSE = 0.25  # [-] of its size by which a finding must change to be reported again
SURELY_BELOW = 2.0  # [sd] by which a change must fall below a level that it had reached
# Kinds that are also fast, then with their bare names: a biased sensor may get stuck, too.
SLOWLY = {"sensor_fault": ".bias", JUMPS: ".creep"}
GONE = "it was repaired, or passed: nothing is left of it"


def of_change(change: Change, of: Suspects, space: Space, rules: Rules, trace: Series) -> Finding:
    """The finding of a slow change."""
    suspect = of.each[change.suspect]
    kind = suspect.kind
    size, sd = suspect.read(change.size, change.size_sd)
    per = suspect.slope(change.size)
    if kind.of_friction and (told := _telling(suspect, trace, change.onset)):
        _, size, sd = told[-1]
        per = size / change.size
    rate, rate_sd = change.rate * per, change.rate_sd * abs(per)
    name, onset = _name(suspect, space), change.onset
    unsure = _unsure(suspect, size, sd)
    text = _said(kind, name, size, unsure, _since(onset, change.began, change.older, change.pause))
    return Finding(
        id=identity(suspect, space) + (f"@{onset:.1f}" if kind.of_tool else ""),
        kind=kind.finding_kind,
        joint=suspect.joint,
        name=name,
        onset_s=onset,
        onset_interval_s=change.began,
        alarm_s=change.alarm,
        severity=severity(suspect.grown(size), kind.warning, kind.critical),
        confidence=change.confidence * trust(kind.finding_kind, rules.named),
        time_to_failure_s=None,
        size=size,
        size_sd=unsure,
        quantity=kind.quantity,
        unit=kind.unit,
        text=text + _likewise(kind),
        advice=kind.advice,
        evidence=_evidence(change, of, rate, rate_sd, _read(suspect, trace)),
        older=change.older,
        pause_s=change.pause,
    )


def _evidence(
    change: Change, of: Suspects, rate: float, rate_sd: float, series: Series
) -> dict[str, Any]:
    """What speaks for a change, and against it; its rate and course as reported."""
    told = {
        "statistic": "log-likelihood ratio beside the healthy arm, over onsets and shapes",
        "nats": None if np.isnan(change.evidence) else change.evidence,
        "rate_per_s": rate,
        "rate_sd": rate_sd,
        "rivals": [
            {"kind": of.each[k].kind.name, "joint": of.each[k].joint, "share": share}
            for k, share in change.rivals
        ],
        "series": _series(series),
    }
    return told | _payload(change.detail) if change.detail else told


def risen(findings: Sequence[Finding], now: Sequence[Finding]) -> list[Finding]:
    """Findings that have changed enough to be reported again."""
    return [new for old, new in zip(findings, now, strict=True) if worse(old, new)]


def up_to_date(
    findings: Sequence[Finding],
    known: Mapping[int, Suspect],
    series: Mapping[int, Series],
    space: Space,
    now: float,
    strays: Mapping[int, float],
) -> list[Finding]:
    """All findings, the slow ones updated to their last block, which ended `now` [s].

    Args:
        strays: how far sizes stray without any fault, by suspect [1/√s].
    """
    slow = {identity(s, space): k for k, s in known.items()}
    return [
        grown(f, known[k], series[k], now, strays[k])
        if (k := slow.get(f.id)) is not None and series.get(k)
        else f
        for f in findings
    ]


def apart(
    findings: Sequence[Finding],
    known: Mapping[int, Suspect],
    terms: Mapping[int, Mapping[str, Any]],
    space: Space,
) -> list[Finding]:
    """Findings with the terms of friction that have grown, by suspect, in their evidence."""
    of = {identity(known[k], space): {"terms": told} for k, told in terms.items()}
    return [replace(f, evidence={**f.evidence, **of[f.id]}) if f.id in of else f for f in findings]


def identity(suspect: Suspect, space: Space) -> str:
    """The name by which a change of a joint is known from run to run."""
    kind = suspect.kind.name
    return f"{kind}.{_name(suspect, space)}{SLOWLY.get(kind, '')}"


def worse(old: Finding, new: Finding) -> bool:
    """Whether a finding has changed enough to be reported again."""
    more = abs(new.size - old.size) >= WORSE * abs(old.size) + new.chance
    grows = new.says.growing and not old.says.growing
    level = new.severity != old.severity or new.gone != old.gone
    return new is not old and (more or grows or level)


def grown(old: Finding, suspect: Suspect, series: Series, now: float, strays: float) -> Finding:
    """A slow finding updated from its series, with its forecast.

    A growing change has the size of its course `now`, from which it is forecast; any other that of
    its last block that tells it, and until there is one, of its alarm.
    """
    told = _telling(suspect, series, old.onset_s)
    if not told:
        return old
    kind, (_, walk) = suspect.kind, suspect.read(series[-1][1], strays)
    series = _read(suspect, series)
    course = trend(told, old.onset_s, now, walk)
    forecast = _forecast(suspect, course) if course else None
    _, size, sd = told[-1]
    if course and forecast:
        size, sd = course.size, course.size_sd
    unsure, at = _unsure(suspect, size, sd), f" at stamp {now:.1f} s," if forecast else ""
    since = _since(old.onset_s, old.onset_interval_s, old.older, old.pause_s)
    text = _said(kind, old.name, size, unsure, since, at)
    gone, level = _gone(suspect, told), severity(suspect.grown(size), kind.warning, kind.critical)
    held = SEVERITIES[0] if gone else _held(old.severity, suspect.grown(size), sd, kind)
    still = f", and may still be at the {held} level" if held != level else ""
    new = replace(
        old,
        size=size,
        size_sd=unsure,
        severity=held,
        text=text + (", gone by now" if gone else still + _likewise(kind)),
        advice=GONE if gone else kind.advice,
        evidence=dict(old.evidence) | {"series": _series(series)},
        gone=gone,
    )
    if course is None:
        return new
    return replace(new, time_to_failure_s=_left(forecast), forecast=forecast)


def _telling(suspect: Suspect, series: Series, onset: float) -> Series:
    """The sizes since a change's onset, as reported, that say whether it is critical.

    One that may as well be none as critical does not: a block may say nothing of its joint.
    """
    critical = suspect.kind.critical

    def tells(size: float, sd: float) -> bool:
        much, doubt = suspect.grown(size), SURELY_BELOW * sd
        return much > doubt or much + doubt < critical

    return [level for level in _read(suspect, series) if level[0] > onset and tells(*level[1:])]


def _gone(suspect: Suspect, told: Series) -> bool:
    """Whether a joint's change is now too small to report, and surely less than it mostly was.

    Its maximum would also be one of noise, which grows with the series.

    Args:
        told: its sizes since its onset, as reported.
    """
    _, size, sd = told[-1]
    left = suspect.grown(size)
    mostly = float(np.median([suspect.grown(each) for _, each, _ in told]))
    least = suspect.kind.least  # of its own state; for all friction, what is not significant
    if suspect.kind.of_friction:
        least = min(least, SURELY_BELOW * sd)
    return suspect.joint is not None and left < least and left + SURELY_BELOW * sd < mostly


def _forecast(suspect: Suspect, course: Course) -> dict[str, Any] | None:
    """Forecast of a change; None where it may as well not grow, or has gone the other way."""
    kind = suspect.kind
    return course.forecast(kind.warning, kind.critical) if suspect.grown(course.size) else None


def _held(before: str, size: float, sd: float, kind: SlowKind) -> str:
    """The severity now; it falls only where the change is surely below a level."""
    now, most = (severity(x, kind.warning, kind.critical) for x in (size, size + SURELY_BELOW * sd))
    return max(now, min(before, most, key=SEVERITIES.index), key=SEVERITIES.index)


def _left(forecast: Mapping[str, Any] | None) -> Mapping[str, float] | None:
    return forecast["to_critical_s"] if forecast else None


def _name(suspect: Suspect, space: Space) -> str:
    if suspect.joint is None:
        return "tool"
    return space.reference.arm.joint_names[suspect.joint]


def _payload(inertials: Sequence[float]) -> dict[str, Any]:
    centre = np.nan_to_num(centre_of_mass(np.array(inertials)))
    return {"mass_kg": inertials[0], "com_m": centre.tolist()}


def _read(suspect: Suspect, trace: Series) -> Series:
    return [(t, *suspect.read(size, sd)) for t, size, sd in trace]


def _series(trace: Series) -> dict[str, list[float]]:
    return {name: [row[k] for row in trace] for k, name in enumerate(("t", "size", "sd"))}


def _unsure(suspect: Suspect, size: float, sd: float) -> float:
    """sd of a size, including that of the value it is a share of."""
    return float(np.hypot(sd, suspect.doubt * size))


def _said(kind: SlowKind, name: str, size: float, sd: float, since: str, at: str = "") -> str:
    half = NORMAL90 * sd  # as in every report
    if kind.unit == "-":
        much, unsure = f"{100 * size:+.1f} %", f"{100 * half:.1f} %"
    else:
        much, unsure = f"{size:+.3g} {kind.unit}", f"{half:.2g}"
    return f"{name}: {kind.quantity} {much} ± {unsure}{at} since {since}"


def _likewise(kind: SlowKind) -> str:
    return f"; {kind.looks_like} looks the same" if kind.looks_like else ""


def _since(
    onset: float, began: tuple[float, float], older: bool, pause: tuple[float, float] | None
) -> str:
    """Since when it is there; of one that may be older than the run, by when it was."""
    if older:
        return f"stamp {began[1]:.1f} s or before"
    if pause is None:
        return f"stamp {onset:.1f} s"
    resting = f"the pause before stamp {pause[1]:.1f} s"
    return resting if pause[0] <= onset <= pause[1] else f"stamp {onset:.1f} s, or {resting}"
