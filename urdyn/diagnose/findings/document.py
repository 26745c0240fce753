"""Findings as a document: findings.json, and what --json prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from urdyn.diagnose.findings.doubt import doubt
from urdyn.diagnose.findings.recommend import arm_health, health, recommendation
from urdyn.diagnose.findings.trust import PASSING
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules import Rules
from urdyn.faults.decision import Costs
from urdyn.io.plain import jsonable
from urdyn.version import __version__

WATCHED = {  # quantities of a history with judged changes, and the kind that judges each
    "friction": "friction_increase",
    "coulomb": "friction_increase",
    "viscous": "viscous_friction",
    "health": "health_degradation",
    "zero": "encoder_offset",
}
ORIGIN = ("urdyn", "provenance")  # of the document; all else describes the run, also in its summary


def findings_document(
    findings: Sequence[Finding],
    joints: Sequence[str],
    judged: Sequence[bool],
    observability: Sequence[Mapping[str, Any]],
    identity: Mapping[str, str],
    source: Mapping[str, str],
    rules: Rules,
    restarts: int = 0,
) -> dict[str, Any]:
    """All findings, what makes them all doubtful, and what to do.

    With the version and the hashes of their sources.

    Args:
        judged: of each joint, whether enough was compared to find anything in it.
        restarts: how often a tracked belief was reset, since no arm explained the data any more.
    """
    costs, heard = rules.costs, dict(zip(joints, judged, strict=True))
    rows, told = health(findings, joints, costs), [jsonable(f.plain()) for f in findings]
    why, first = doubt(told, len(joints), restarts)
    advice = recommendation(findings, costs, heard)
    origin = {"twin.sha256": identity.get("twin", ""), "rules": identity.get("rules", "")}
    document = {
        "urdyn": __version__,
        "provenance": origin | dict(source),
        **({"doubt": why} if why else {}),
        "findings": told,
        "arm": _arm(rows, costs, judged, findings),
        "joints": [row | {"judged": heard[row["name"]]} for row in rows],
        "recommendation": advice | {"text": first + advice["text"]},
        "levels": {quantity: _levels(rules, kind) for quantity, kind in WATCHED.items()},
        "observability": {"joint_backlash": list(observability)},
    }
    return dict(jsonable(document))


def _levels(rules: Rules, kind: str) -> dict[str, float]:
    """The sizes from which it matters, and must not grow."""
    levels = rules.levels(kind)
    return {"warning": levels.warning, "critical": levels.critical}


def _arm(
    rows: Sequence[Mapping[str, Any]],
    costs: Costs,
    judged: Sequence[bool],
    findings: Sequence[Finding],
) -> dict[str, Any]:
    """The arm's health; null where no joint was judged, and no wear was found."""
    told = arm_health(rows, costs) | {"judged": all(judged)}
    known = any(judged) or any(f.kind not in PASSING for f in findings)
    return told if known else told | {"health_index": None}
