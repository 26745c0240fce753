"""How far to trust a finding's name, from how often earlier ones were right.

The evidence divides a finding's probability among the suspects, as if the model held. Campaigns of
simulated faults show how often a name was right: of n findings of a kind r had the right kind and
joint, and by the rule of succession, with the rate common to all kinds as the prior [Laplace1774]_,

    p(right) = (r + m p_0) / (n + m)        p_0 = (sum r + 1) / (sum n + 2)

That holds for findings alone or in pairs. Many at once have one cause that the model lacks, or are
one fault and its shadows: an arm seldom has more than two. Pushes and loads pass, and may follow
each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from urdyn.diagnose.kinds.finding import Finding

AT_ONCE = 60.0  # [s] from alarm to alarm
ALONE = "confidence_alone"
PASSING = ("collision", "payload_change")  # kinds that need no service
PAIR = 2  # faults that an arm may have at once
ALIKE = 5.0  # findings m that the common rate is worth


def trust(kind: str, named: Mapping[str, Sequence[int]]) -> float:
    """Probability that a name is right, if nothing makes it doubtful [-].

    Args:
        named: by kind, right findings, and all.
    """
    right, told = (sum(counts[k] for counts in named.values()) for k in (0, 1))
    common = (right + 1.0) / (told + 2.0)
    r, n = named.get(kind, (0, 0))
    return (r + ALIKE * common) / (n + ALIKE)


def in_company(findings: Sequence[Finding]) -> list[Finding]:
    """Findings with their joint confidence; `evidence` holds that of each alone.

    It covers all findings reported so far.
    """
    alarms = np.array([f.alarm_s for f in findings])
    lasting = np.sort([f.alarm_s for f in findings if f.kind not in PASSING])
    first = np.searchsorted(lasting, alarms - AT_ONCE, "right")
    many = np.searchsorted(lasting, alarms + AT_ONCE, "left") - first
    shares = np.minimum(1.0, PAIR / np.maximum(many, 1))
    return [_rated(f, share) for f, share in zip(findings, shares.tolist(), strict=True)]


def _rated(finding: Finding, share: float) -> Finding:
    """The finding with this share of its confidence alone; itself where that is what it has."""
    alone = finding.evidence.get(ALONE, finding.confidence)
    confidence = alone * share
    if ALONE in finding.evidence and confidence == finding.confidence:
        return finding  # pushes are many
    evidence = dict(finding.evidence) | {ALONE: alone}
    return replace(finding, confidence=confidence, evidence=evidence)
