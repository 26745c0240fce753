"""What showed at once and is explained by a change of the joint that is found later.

Friction that has grown presses one way until its joint turns over, and so may look like a push that
is over by then; and where the joint turns over it is another than was thought, which recurs as play
does. Who is pushed feels it in more joints as a rule.
"""

from __future__ import annotations

from collections.abc import Sequence

from urdyn.diagnose.finding import Finding
from urdyn.diagnose.pace import BEAT
from urdyn.diagnose.trust import PASSING

FRICTION = "friction_increase"


def unexplained(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Without pushes that one joint alone felt, and jolts that recur, that its change explains.

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
