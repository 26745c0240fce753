"""A recording diagnosed at once: the same beats and moments as live, one function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.document import findings_document
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.rules import Rules, read_rules
from urdyn.errors import LogError
from urdyn.identify.fit import Fit
from urdyn.model.friction import travel
from urdyn.signal import condition
from urdyn.types import Log


@dataclass(frozen=True)
class Report:
    """What was found in a recording."""

    findings: tuple[Finding, ...]
    document: Mapping[str, Any]  # as findings.json has it

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def __str__(self) -> str:
        told = [f"{f.severity}: {f.kind}: {f.text}" for f in self.findings]
        return "\n".join(told) or "nothing found"


def diagnose(fit: Fit, log: Log, rules: Rules | None = None) -> Report:
    """The faults in a log of the arm that was commissioned by `fit`.

    report = urdyn.diagnose(twin.fit, urdyn.read("monday.parquet"))
    print(report)

    Raises:
        LogError: it is of an arm with other joints, or its currents are not in amperes.
    """
    if why := fit.dynamics.unlike(log.joint("actual_current")):
        raise LogError(why, log.source.path)
    motion = condition(log, offset=fit.dynamics.drive.time_offset)
    diagnosis = Diagnosis(fit, float(np.median(np.diff(log.t))), rules or read_rules())
    moved = np.cumsum(np.abs(travel(motion)), axis=0)
    state, found = diagnosis.over(motion, fit.dynamics.presliding(motion), moved)
    source = {"source": log.source.path, "source.sha256": log.source.sha256}
    observable, costs = diagnosis.observable(state), diagnosis.rules.costs
    joints = fit.dynamics.arm.joint_names
    document = findings_document(found, joints, observable, {}, source, costs)
    return Report(tuple(found), document)
