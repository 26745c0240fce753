"""A twin's recommendation: service now, later, or not at all, by expected cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from urdyn.diagnose.findings.trust import PASSING
from urdyn.diagnose.kinds.finding import Finding
from urdyn.faults.decision import Costs, Decision, decide, outlook
from urdyn.io.run_folder import PUSH, SEVERITIES, quiet
from urdyn.report.digits import number
from urdyn.types import Array

OFTEN = 3  # pushes on one link, after which the next may be expected, too
SOON = 1e-3  # [h] until what is beyond its critical level is assumed to end the work
HOUR = 3600.0  # [s]


def recommendation(
    findings: Sequence[Finding], costs: Costs, judged: Mapping[str, bool] | None = None
) -> dict[str, Any]:
    """The choice for the finding to be serviced first, in numbers and a sentence.

    Acknowledging a finding makes the arm no safer: it counts as before.

    Args:
        judged: by a joint's name, whether enough was compared to find anything; None: for all.
    """
    said: dict[str, Any]
    choices = [(_decision(f, costs), f) for f in findings]
    grave = [(d, f) for d, f in choices if d.advice != "never"]
    if not grave:
        worst = max((d for d, _ in choices), key=lambda d: d.never, default=_sound(costs))
        said = {"advice": "never", "finding": None, "expected_cost": _told(worst)}
    else:
        decision, finding = min(grave, key=lambda pair: _due(pair[0]))
        said = {
            "advice": decision.advice,
            "finding": finding.id,
            "service_in_h": _due(decision),
            "expected_cost": _told(decision),
        }
    return said | {"text": sentence(said, [vars(f) for f in findings], judged or {})}


def sentence(
    said: Mapping[str, Any], findings: Sequence[Mapping[str, Any]], judged: Mapping[str, bool]
) -> str:
    """A choice in words; choice and findings are as in findings.json."""
    if said["finding"] is None:
        return _no_service(findings, judged, said["expected_cost"])
    of = next(f for f in findings if f["id"] == said["finding"])
    now = said["advice"] == "now"
    when = "service now" if now else f"service within {said['service_in_h']:.0f} h"
    return f"{when}: {of['name']}, {of['advice']}{' (acknowledged)' if of['acknowledged'] else ''}"


def health(
    findings: Sequence[Finding], joints: Sequence[str], costs: Costs
) -> list[dict[str, Any]]:
    """Joint by joint, the probability that it does not end the work within the notice.

    Notice is the time in which a service can be planned. Found faults go on independently, and new
    ones may come up: a joint that wears out once in its life does so at any time.
    """
    unseen = float(np.exp(-costs.notice / costs.life))
    rows = []
    for j, name in enumerate(joints):
        of = [f for f in findings if f.joint == j and f.kind not in PASSING]
        lasts = [1.0 - np.interp(costs.notice, *_outlook(f, costs)) for f in of]
        index = unseen * float(np.prod(lasts))
        rows.append({"joint": j, "name": name, "health_index": index, "horizon_h": costs.notice})
    return rows


def arm_health(rows: Sequence[Mapping[str, Any]], costs: Costs) -> dict[str, Any]:
    """Probability that no joint of the arm ends the work within the notice.

    Joints wear independently, so it is the product of theirs.

    Args:
        rows: of `health`.
    """
    index = float(np.prod([row["health_index"] for row in rows]))
    return {"health_index": index, "horizon_h": costs.notice}


def _decision(finding: Finding, costs: Costs) -> Decision:
    return decide(*_outlook(finding, costs), costs) if _ends_work(finding) else _sound(costs)


@lru_cache(maxsize=8)
def _sound(costs: Costs) -> Decision:
    """Where no finding ends the work; cached, as a day may have many pushes."""
    return decide(*outlook(costs), costs)


def _told(decision: Decision) -> dict[str, float]:
    """Expected cost of each choice, in planned services."""
    return {"now": decision.now, "later": decision.later, "never": decision.never}


def _outlook(finding: Finding, costs: Costs) -> tuple[Array, Array]:
    """Times from now [h], and probabilities that the finding has ended the work by then."""
    left = finding.time_to_failure_s
    if left is not None:
        told = (left["median"] / HOUR, left["lo"] / HOUR, left["hi"] / HOUR)
        return outlook(costs, finding.confidence, *told)
    if _ends_work(finding):
        return outlook(costs, finding.confidence, SOON, SOON, SOON)
    return outlook(costs)


def _ends_work(finding: Finding) -> bool:
    """Whether it is expected to end the work, now or in time."""
    grave = finding.severity == "critical" and finding.kind not in PASSING
    return grave or finding.time_to_failure_s is not None


def _due(decision: Decision) -> float:
    """When a service is due [h], from now."""
    return 0.0 if decision.advice == "now" else decision.later_at


def _no_service(
    findings: Sequence[Mapping[str, Any]], judged: Mapping[str, bool], worst: Mapping[str, float]
) -> str:
    """The text where no service would pay; new findings are to be looked at all the same.

    Args:
        worst: expected costs of the finding that costs most if left alone.
    """
    if not findings:
        return _nothing_found([name for name, enough in judged.items() if not enough], len(judged))
    fresh = [f for f in findings if not quiet(f)]
    due = "no service is due"
    if worst["never"] > 0.0:  # something is expected to fail, and no service would pay
        due = f"{due}, {_weighed(worst)}"
    if not fresh:
        return f"{due}: all that was found is known, or gone by now"
    gravest = max(fresh, key=lambda f: (SEVERITIES.index(f["severity"]), f["alarm_s"]))
    alike = dict.fromkeys(f["name"] for f in fresh if f["advice"] == gravest["advice"])
    return f"{due}; {', '.join(alike)}: {gravest['advice']}{_recurring(fresh)}"


def _recurring(fresh: Sequence[Mapping[str, Any]]) -> str:
    """How often a link was pushed, and what to do where the work does that; "" if seldom."""
    onsets = dict[str, list[float]]()
    for push in (f for f in fresh if f["kind"] == PUSH):
        onsets.setdefault(push["name"], []).append(push["onset_s"])
    name, times = max(onsets.items(), key=lambda of: len(of[1]), default=("", []))
    if len(times) < OFTEN:
        return ""
    return (
        f"; {len(times)} pushes on {name}, every {number(np.median(np.diff(sorted(times))))} s or "
        "so: if that is the work, name what tells of it by --contact, or raise least and "
        "warning of [kind.collision] in the rules"
    )


def _weighed(cost: Mapping[str, float]) -> str:
    """Why nothing is serviced although it may fail."""
    never, now, later = (f"{cost[choice]:.3g}" for choice in ("never", "now", "later"))
    return (
        f"by [costs] of the rules: to go on is expected to cost {never} planned services, to "
        f"service now {now}, later no less than {later}"
    )


def _nothing_found(unjudged: Sequence[str], joints: int) -> str:
    """The text where nothing was found."""
    if unjudged and len(unjudged) == joints:
        return "too little was compared to judge: track it for longer, while its joints move"
    told = "leave it at work: nothing was found"
    if not unjudged:
        return told
    return (
        f"{told}; too little was seen of {', '.join(unjudged)}, now or at commissioning, to judge"
    )
