"""Pushes that were none: what one joint alone felt, and a change of that joint explains.

Friction that has grown presses one way until its joint turns over, and so may look like a push that
is over by then. Who is pushed feels it in more joints as a rule, and nothing is left of it.
"""

from __future__ import annotations

from collections.abc import Sequence

from urdyn.diagnose.finding import Finding
from urdyn.diagnose.pace import BEAT
from urdyn.diagnose.trust import PASSING


def unpushed(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Without pushes that a joint has made itself, as is known by now.

    From when its change may have begun on until that is told, nobody knows what the joint does.
    """
    own = [f for f in findings if f.kind not in PASSING]

    def explained(push: Finding) -> bool:
        return push.kind == "collision" and any(
            f.joint == push.says.alone and f.onset_interval_s[0] - BEAT <= push.onset_s <= f.alarm_s
            for f in own
        )

    return tuple(f for f in findings if not explained(f))
