"""Fast findings that a change of the joint, found later, explains.

Friction that has grown acts one way until its joint reverses, and so may look like a push that ends
then; and its difference at reversals recurs as play does. A push usually loads more than one joint.
"""

from __future__ import annotations

from collections.abc import Sequence

from urdyn.diagnose.findings.trust import PASSING
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.residual.pace import BEAT

FRICTION = "friction_increase"


def unexplained(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Without pushes on one joint alone, and recurring jolts, that its change explains.

    Between the earliest possible onset of the change and its alarm the joint's torque is
    unexplained; how its new friction behaves at reversals stays unknown from then on.
    """

    def explains(change: Finding, shown: Finding) -> bool:
        since = shown.onset_s >= change.onset_interval_s[0] - BEAT
        if shown.kind == "collision":
            return change.joint == shown.says.alone and since and shown.onset_s <= change.alarm_s
        recurs = shown.kind == "joint_backlash" and shown.says.recurs_at is not None
        return recurs and since and (change.kind, change.joint) == (FRICTION, shown.joint)

    changes = [f for f in findings if f.kind not in PASSING]  # pushes are many
    return tuple(f for f in findings if not any(explains(change, f) for change in changes))
