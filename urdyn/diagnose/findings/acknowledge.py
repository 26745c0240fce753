"""Findings that somebody has seen: quiet until they get worse, or are gone and come back.

Who sets the controller to a load has seen it, unless it is critical.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from urdyn.diagnose.findings.recommend import sentence
from urdyn.diagnose.kinds.finding import Finding
from urdyn.errors import InputError
from urdyn.io import write_text, writing
from urdyn.io.run_folder import FINDINGS, SEVERITIES
from urdyn.report.findings import DAMAGE

FILE = "acknowledged.json"
WORSE = 1.5  # [-] times its size when it was seen
STAMP = re.compile(r"@-?\d+\.\d$")  # ends the id of a push; names of joints may hold "@", too


@dataclass(frozen=True)
class Acknowledged:
    """Acknowledged findings: by name, how bad each was then."""

    seen: Mapping[str, Mapping[str, Any]]

    def quiets(self, finding: Finding) -> bool:
        """Whether a finding is known and not surely worse than it was."""
        then = self.seen.get(finding.id)
        if then is None:
            return False
        worse = SEVERITIES.index(finding.severity) > SEVERITIES.index(then["severity"])
        return not worse and abs(finding.size) <= WORSE * abs(float(then["size"])) + finding.chance


def acknowledged(folder: Path) -> Acknowledged:
    """What was acknowledged in a folder."""
    path = folder / FILE
    return Acknowledged(_table(path) if path.exists() else {})


def as_set(findings: Sequence[Finding]) -> list[Finding]:
    """Findings of an arm whose controller is set to the tracked load."""
    return [
        replace(f, severity=SEVERITIES[0], acknowledged=True)
        if f.kind == "payload_change" and f.severity != SEVERITIES[-1]
        else f
        for f in findings
    ]


def acknowledge(folder: Path, name: str) -> list[Mapping[str, Any]]:
    """Mark findings of DIR/findings.json as seen, as tracking again would; returns them.

    Args:
        name: the id of one, or else that of several without their stamps, such as "@2.7".

    Raises:
        InputError: there is no such finding, or no findings at all, or they are damaged.
    """
    document = _read(folder / FINDINGS, "track the log again")
    found = document.get("findings") if isinstance(document, dict) else None
    each = found if isinstance(found, list) else []
    findings = {f["id"]: f for f in each if isinstance(f, dict) and isinstance(f.get("id"), str)}
    alike = {key: f for key, f in findings.items() if STAMP.sub("", key) == name}
    named = {name: findings[name]} if name in findings else alike
    if not named:
        there = ", ".join(findings) or "none"
        raise InputError(f"{folder}: has no finding {name!r}; there is {there}")
    new = {key: {"severity": f.get("severity"), "size": f.get("size")} for key, f in named.items()}
    seen = {**acknowledged(folder).seen, **new}
    if not _right(seen):
        raise InputError(
            f"{folder / FINDINGS}: does not say how bad {name} is; track the log again"
        )
    try:
        before = _advised(document)
        for finding in named.values():
            finding["acknowledged"] = True
        said = document["recommendation"]
        said["text"] = said["text"].replace(before, _advised(document))  # the text before it stays
    except (*DAMAGE, StopIteration) as error:
        where = folder / FINDINGS
        raise InputError(f"{where}: is damaged ({error!r}); track the log again") from error
    # Both or none: a disk may be full.
    with writing(folder / FILE) as known, writing(folder / FINDINGS) as told:
        known.write(json.dumps(seen, indent=2).encode() + b"\n")
        told.write(json.dumps(document, indent=2).encode() + b"\n")
        known.flush()
        told.flush()
    return list(named.values())


def _advised(document: Mapping[str, Any]) -> str:
    """The recommendation for these findings as they stand now."""
    judged = {row["name"]: row["judged"] for row in document["joints"]}
    return sentence(document["recommendation"], document["findings"], judged)


def forget_gone(folder: Path, findings: Sequence[Finding], ended: bool = False) -> Acknowledged:
    """What was acknowledged, without what is gone, or was not found in a run that has ended.

    If it returns, it is another fault.
    """
    seen, gone = acknowledged(folder).seen, {f.id: f.gone for f in findings}
    left = {name: dict(of) for name, of in seen.items() if not gone.get(name, ended)}
    if not left:
        (folder / FILE).unlink(missing_ok=True)
    elif len(left) < len(seen):
        write_text(folder / FILE, json.dumps(left, indent=2) + "\n")
    return Acknowledged(left)


def _table(path: Path) -> dict[str, Any]:
    table = _read(path, "remove it")
    if not _right(table):
        raise InputError(f"{path}: does not say what was acknowledged; remove it")
    return dict(table)


def _right(table: Any) -> bool:
    """Whether the table states how bad every finding was."""
    return isinstance(table, dict) and all(
        isinstance(row, dict)
        and row.get("severity") in SEVERITIES
        and isinstance(row.get("size"), int | float)
        for row in table.values()
    )


def _read(path: Path, advice: str) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path}: is no JSON ({error}); {advice}") from error
