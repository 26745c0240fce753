"""A finding of `findings.json` in everyday words and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.io.run_folder import over
from urdyn.io.spans import Clock, span_of
from urdyn.report.digits import interval90, number, percent
from urdyn.report.names import spoken

UNJUDGED = "not judged"
KINDS = {
    "friction_increase": "friction increase",
    "health_degradation": "drive health loss",
    "joint_backlash": "backlash",
    "controller_instability": "instability",
    "payload_change": "payload change",
    "collision": "collision",
    "encoder_offset": "encoder offset",
    "sensor_fault": "sensor fault",
}
FRAMES = {"base": "the pendant's base", "root": "the root link"}  # a push's axes
SHOWS = {"dropped": "silent", "encoder": "stuck or silent"}  # modes of a sensor, in words


def kind(finding: Mapping[str, Any]) -> str:
    """Its kind, in words."""
    name = str(finding["kind"])
    return KINDS.get(name, name.replace("_", " "))


def when(finding: Mapping[str, Any], start: float, time: Clock) -> str:
    """Since when it is there, or when it was and for how long; `start` is the first stamp [s]."""
    evidence, began = finding["evidence"], finding["onset_s"] - start
    if before(finding, start):
        since = f"since {by(finding, start, time)}"
    elif over(finding):
        since = f"at {time(began)}"
    else:
        since = f"since {time(began)}"
    if finding["gone"]:
        return f"{since}, gone by now"
    lasted = evidence.get("duration_s")
    if "until_s" in evidence:
        ended = time(evidence["until_s"] - start)
        if ended != time(began):
            return f"{since}, until {ended}"
        lasted = evidence["until_s"] - finding["onset_s"]
    return since if lasted is None else f"{since} for {number(lasted)} s"


def before(finding: Mapping[str, Any], start: float) -> bool:
    """Whether it may have begun before the run, whose first stamp is `start` [s]."""
    return bool(finding["older"] or finding["onset_s"] < start)


def by(finding: Mapping[str, Any], start: float, time: Clock) -> str:
    """By when one that may have begun before the run was there: the end of its interval."""
    return f"{time(max(finding['onset_interval_s'][1] - start, 0.0))} or before"


def left(finding: Mapping[str, Any]) -> str:
    """The time from the run's last stamp to its critical level; "" where unknown."""
    times = finding["time_to_failure_s"]
    if not times:
        return ""
    return "level passed" if passed(times) else span_of(times)


def ahead(finding: Mapping[str, Any]) -> str:
    """When its levels will be reached, or that they are passed; "" unless it surely grows."""
    return ", ".join(
        f"{name} passed" if passed(times) else f"{name} in {span_of(times)}"
        for name, times in _levels(finding).items()
    )


def rising(finding: Mapping[str, Any]) -> str:
    """Its severity, which shows the levels passed, and when the others will be reached."""
    coming = (
        f"{name} in {span_of(times)}"
        for name, times in _levels(finding).items()
        if not passed(times)
    )
    return ", ".join([str(finding["severity"]), *coming])


def _levels(finding: Mapping[str, Any]) -> dict[str, Mapping[str, float]]:
    """Times to the levels of a finding that surely grows [s]."""
    told = finding["forecast"]
    return {name: told[f"to_{name}_s"] for name in ("warning", "critical")} if told else {}


def lasting(arm: Mapping[str, Any]) -> str:
    """The probability that all joints of an arm last until a service can be planned."""
    index = arm["health_index"]
    return UNJUDGED if index is None else f"{percent(index)}, the chance {sound(arm)}"


def sound(arm: Mapping[str, Any]) -> str:
    """The event whose probability is an arm's health index."""
    few = "" if arm["judged"] else ", as far as they were judged"
    return f"that no joint becomes critical within {number(arm['horizon_h'])} h{few}"


def passed(times: Mapping[str, float]) -> bool:
    """Whether a level is behind rather than ahead."""
    return times["median"] <= 0.0


def sentence(finding: Mapping[str, Any], start: float, time: Clock) -> str:
    """A finding in a line, as in a list of many robots."""
    where = f"{spoken(finding['name'])} " if finding["name"] else ""
    known = ", acknowledged" if finding["acknowledged"] else ""
    told = f"{where}{kind(finding)} {when(finding, start, time)}, {finding['severity']}{known}"
    times, ends = finding["time_to_failure_s"], left(finding)
    if times and not passed(times):  # whoever reads a list reads it later
        ends = f"critical {ends} after the run’s last stamp"
    return "; ".join(filter(None, (told, ends)))


def factor(finding: Mapping[str, Any]) -> float:
    """The factor that makes a size readable: ratios in per cent."""
    return 100.0 if finding["unit"] == "-" else 1.0


def unit(finding: Mapping[str, Any]) -> str:
    """The unit after that factor."""
    return "%" if finding["unit"] == "-" else str(finding["unit"])


def amount(finding: Mapping[str, Any], value: float) -> str:
    """A size of the finding, signed, with its unit."""
    return f"{'+' if value > 0.0 else ''}{number(factor(finding) * value)} {unit(finding)}"


def direction(evidence: Mapping[str, Any]) -> str:
    """Which way a push went, with 90 % intervals."""
    along = ", ".join(map(interval90, evidence["force_N"], evidence["force_sd_N"]))
    return f"({along}) N along x, y, z of {FRAMES[evidence['frame']]}"


def size(finding: Mapping[str, Any]) -> str:
    """Its size with its 90 % interval; its mode where it has no size."""
    evidence = finding.get("evidence", {})
    if mode := evidence.get("mode"):
        return SHOWS.get(mode, str(mode)) + (", well again" if "until_s" in evidence else "")
    if "was_rad" in evidence:
        return f"{number(evidence['was_rad'])} rad, right again"
    by = factor(finding)
    value, sd = by * finding["size"], by * (finding["size_sd"] or 0.0)
    return f"{interval90(value, sd) if sd else number(value)} {unit(finding)}"
