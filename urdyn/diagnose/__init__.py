"""From an arm's behaviour to its faults: one fault, one finding.

What runs is here; what it asks is in rooms, each of which knows only those below it:

    findings       in a plant's words, and the book of them
    slow | fast    changes that last, from moments; events, from a beat of rows
    load           at the tool
    kinds          what can be found: rules, suspects, and the values in which it is said
    residual       what the commissioned model leaves unexplained
"""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.diagnose.diagnosis import Diagnosis
    from urdyn.diagnose.kinds.finding import Finding
    from urdyn.diagnose.kinds.rules import Rules
    from urdyn.diagnose.kinds.rules_file import read_rules
    from urdyn.diagnose.offline import Report, diagnose

__all__ = ["Diagnosis", "Finding", "Report", "Rules", "diagnose", "read_rules"]

__getattr__ = lookup(
    __name__,
    {
        "urdyn.diagnose.diagnosis": ("Diagnosis",),
        "urdyn.diagnose.kinds.finding": ("Finding",),
        "urdyn.diagnose.offline": ("Report", "diagnose"),
        "urdyn.diagnose.kinds.rules": ("Rules",),
        "urdyn.diagnose.kinds.rules_file": ("read_rules",),
    },
)
