"""The paper's tables, measured on this machine: its scenario, and a whole virtual arm."""

from urdyn.bench.arm import Group, VirtualArm, groups, virtual_run
from urdyn.bench.joint import Followed, follow_friction, follow_health
from urdyn.bench.paper import ALGORITHMS, CONFIGURATIONS, GROUPS
from urdyn.bench.ramps import Ramps, ramps

__all__ = [
    "ALGORITHMS",
    "CONFIGURATIONS",
    "GROUPS",
    "Followed",
    "Group",
    "Ramps",
    "VirtualArm",
    "follow_friction",
    "follow_health",
    "groups",
    "ramps",
    "virtual_run",
]
