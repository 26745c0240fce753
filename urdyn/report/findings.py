"""The findings of a diagnosis, from `findings.json`, the most urgent first."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.plain import plain
from urdyn.io.run_folder import FINDINGS, Entry, quiet, urgency
from urdyn.report.track.change import LEVELS, Levels

DUE = ("now", "later")  # recommendations where a service pays
LEFT = ("median", "lo", "hi")
WHEN = ("onset_s", "onset_interval_s", "older")
TOLD = ("kind", "joint", "name", *WHEN, "severity", "confidence", "acknowledged", "gone")
LASTING = ("duration_s", "until_s")  # of the evidence, shown in a list of many
DAMAGE = (LookupError, TypeError, ValueError, AttributeError, OverflowError, RecursionError)

Arm = Mapping[str, Any]  # the probability that an arm lasts, as in the file


@dataclass(frozen=True)
class Found:
    """A diagnosis of a robot."""

    findings: tuple[Entry, ...]  # that to be serviced first, then most urgent first
    unjudged: tuple[str, ...]  # joints with too little data
    arm: Arm | None  # health index of the whole arm; None: an older version's file
    due: str  # "now" or "later": service for the first finding; "": acknowledged, or none
    doubt: str  # a reason to doubt all of them; "": none
    levels: Levels  # by which changes are judged


def read_findings(folder: Path, joints: Sequence[str]) -> Found | None:
    """The diagnosis in a track folder; None: it was not diagnosed.

    Raises:
        InputError: the file is damaged; the reason, without the folder's name.
    """
    path = folder / FINDINGS
    if not path.exists():
        return None
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        whole = document if isinstance(document, dict) else {"findings": document}
        due, first = _due(whole)
        serviced, others = list[Entry](), list[Entry]()
        for entry in whole["findings"]:
            part = serviced if due and entry.get("id") == first else others
            part.append(_whole(entry, joints))
        entries = (*serviced, *ranked(others))
        unseen = tuple(unjudged(whole.get("joints", ())))
        doubt = str(whole.get("doubt", ""))
        levels = {**LEVELS, **{of: _numbers(each) for of, each in whole.get("levels", {}).items()}}
        return Found(entries, unseen, _arm(whole), due, doubt, levels)
    except OSError as error:
        raise InputError(f"its {FINDINGS} cannot be read: {error.strerror}") from error
    except DAMAGE as error:
        raise InputError(f"its {FINDINGS} is damaged ({error}); track the log again") from error


def unjudged(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Joints that a diagnosis saw too little of, from its rows on each joint."""
    return [str(row["name"]) for row in rows if not row.get("judged", True)]


def ranked(entries: Sequence[Entry]) -> list[Entry]:
    """Findings, most urgent first; equally urgent ones in their given order."""
    return sorted(entries, key=lambda entry: (*(-x for x in urgency(entry)[:2]), entry["onset_s"]))


def told(finding: Entry) -> dict[str, Any]:
    """A finding in plain numbers, for a list of many."""
    left, whole = finding["time_to_failure_s"], dict(finding)
    times = {name: plain(_time(left[name])) for name in LEFT} if left else left
    return {name: whole[name] for name in TOLD} | {"time_to_failure_s": times}


def _whole(entry: Mapping[str, Any], joints: Sequence[str]) -> Entry:
    """An entry, completed where older versions lack a field."""
    joint, left = entry["joint"], entry["time_to_failure_s"]
    if joint is not None and not 0 <= int(joint) < len(joints):
        raise ValueError(f"joint {joint} of {len(joints)}")
    name = "" if joint is None else joints[int(joint)]
    begin, end = entry.get("onset_interval_s", 2 * [entry["onset_s"]])
    evidence = entry.get("evidence")
    said = evidence if isinstance(evidence, Mapping) else {}
    return {
        "kind": str(entry["kind"]),
        "joint": None if joint is None else int(joint),
        "name": str(entry.get("name", name)),
        "onset_s": _finite(entry["onset_s"]),
        "onset_interval_s": [_finite(begin), _finite(end)],
        "severity": str(entry["severity"]),
        "confidence": _finite(entry["confidence"]),
        "time_to_failure_s": left and {end: _time(left[end]) for end in LEFT},
        "acknowledged": bool(entry.get("acknowledged", False)),
        "older": bool(entry.get("older", False)),
        "gone": bool(entry.get("gone", False)),
        "evidence": {end: _finite(said[end]) for end in LASTING if said.get(end) is not None},
    }


def _arm(whole: Mapping[str, Any]) -> Arm | None:
    """The probability that the arm lasts, where given."""
    said = whole.get("arm")
    if said is None:
        return None
    index = said["health_index"]
    return {
        "health_index": None if index is None else _finite(index),
        "horizon_h": _finite(said["horizon_h"]),
        "judged": bool(said["judged"]),
    }


def _numbers(levels: Mapping[str, Any]) -> Mapping[str, float]:
    """The levels of a quantity."""
    return {name: _finite(levels[name]) for name in ("warning", "critical")}


def _due(whole: Mapping[str, Any]) -> tuple[str, Any]:
    """When a service is recommended for a finding that is not quiet, and its id; "": never."""
    said = whole.get("recommendation") or {}
    known = {entry.get("id") for entry in whole["findings"] if quiet(entry)}
    if said.get("finding") is None or said["finding"] in known or said["advice"] not in DUE:
        return "", None
    return str(said["advice"]), said["finding"]


def _time(value: float | None) -> float:
    """A time to failure [s]; None never comes."""
    return np.inf if value is None or value == np.inf else _finite(value)


def _finite(value: float) -> float:
    """A number that is one."""
    if not np.isfinite(number := float(value)):
        raise ValueError(f"{number} is no number")
    return number
