"""How far a finding's name is to be trusted: what became of those told before.

The evidence shares a finding's probability out among the faults that were looked for, as if the
model held. Campaigns of simulated faults tell how often a name was right all the same: of n
findings of a kind r had the right kind and joint, and by the rule of succession, with what
all kinds have in common as the prior [Laplace1774]_,

    p(right) = (r + m p_0) / (n + m)        p_0 = (sum r + 1) / (sum n + 2)

That is of findings that come alone or in pairs. Many at once are one cause that the model has no
word for, or one fault and its shadows: an arm seldom has more than two, whichever they are. Pushes
and loads pass, and may follow each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from urdyn.diagnose.finding import Finding

AT_ONCE = 60.0  # [s] from alarm to alarm
ALONE = "confidence_alone"
PASSING = ("collision", "payload_change")  # kinds that nobody services
PAIR = 2  # faults that an arm may have at once
ALIKE = 5.0  # findings m that what all kinds have in common is worth


def trust(kind: str, named: Mapping[str, Sequence[int]]) -> float:
    """Probability that a name is right which nothing speaks against [-].

    Args:
        named: by kind, findings that were right, and all.
    """
    right, told = (sum(counts[k] for counts in named.values()) for k in (0, 1))
    common = (right + 1.0) / (told + 2.0)
    r, n = named.get(kind, (0, 0))
    return (r + ALIKE * common) / (n + ALIKE)


def in_company(findings: Sequence[Finding]) -> list[Finding]:
    """Findings as far as they are to be trusted beside each other; `evidence` has it of each alone.

    Whenever it is asked, of all that were told by then.
    """
    told, alarms = [], np.sort([f.alarm_s for f in findings if f.kind not in PASSING])
    for finding in findings:
        alone = finding.evidence.get(ALONE, finding.confidence)
        first = np.searchsorted(alarms, finding.alarm_s - AT_ONCE, "right")
        many = max(1, int(np.searchsorted(alarms, finding.alarm_s + AT_ONCE, "left") - first))
        evidence = dict(finding.evidence) | {ALONE: alone}
        told.append(replace(finding, confidence=alone * min(1.0, PAIR / many), evidence=evidence))
    return told
