"""From an arm's behaviour to its faults: one fault, one finding."""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.diagnose.diagnosis import Diagnosis
    from urdyn.diagnose.finding import Finding
    from urdyn.diagnose.offline import Report, diagnose
    from urdyn.diagnose.rules import Rules
    from urdyn.diagnose.rules_file import read_rules

__all__ = ["Diagnosis", "Finding", "Report", "Rules", "diagnose", "read_rules"]

__getattr__ = lookup(
    __name__,
    {
        "urdyn.diagnose.diagnosis": ("Diagnosis",),
        "urdyn.diagnose.finding": ("Finding",),
        "urdyn.diagnose.offline": ("Report", "diagnose"),
        "urdyn.diagnose.rules": ("Rules",),
        "urdyn.diagnose.rules_file": ("read_rules",),
    },
)
