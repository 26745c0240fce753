"""Fast findings that a change of the joint, found later, explains.

Friction that has grown acts one way until its joint reverses, and so may look like a push that ends
then; and its difference at reversals recurs as play does. A push usually loads more than one joint.
What seemed to be one tells when the change came: to a beat, where slow tests have parts of blocks,
and none that it lasted into.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from urdyn.diagnose.findings.trust import PASSING
from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.residual.pace import BEAT
from urdyn.diagnose.slow.onsets import WITHIN
from urdyn.diagnose.slow.slow import BLOCK

FRICTION = "friction_increase"
RESOLVED = BLOCK / len(WITHIN)  # [s] between the onsets of which one first shows a change


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


def timed(change: Change, joint: int | None, findings: Sequence[Finding]) -> Change:
    """A change that came at once, by the push on its joint alone as which it was first felt.

    It may have come since the onset before the one that first shows it; and it was there by then.
    """
    if joint is None or change.rate or change.older:
        return change
    since, until = change.shown[0] - RESOLVED, change.began[1]
    felt = [
        f
        for f in findings
        if f.kind == "collision" and f.says.alone == joint and since <= f.onset_s <= until
    ]
    if not felt:
        return change
    push = min(felt, key=lambda f: f.onset_s)
    first, last = push.onset_interval_s
    began = (min(change.began[0], first), last)
    pause = change.pause if change.pause and change.pause[0] < last else None
    return replace(change, onset=push.onset_s, began=began, pause=pause)
