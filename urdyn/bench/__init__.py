"""The paper's tables, measured on this machine: its scenario, and a whole virtual arm."""

from urdyn.bench.arm import Group, Tracked, VirtualArm, groups, virtual_run
from urdyn.bench.joint import Followed, follow_friction, follow_health
from urdyn.bench.paper import ALGORITHMS, CONFIGURATIONS, FAULTS, GROUPS
from urdyn.bench.ramps import Ramps, ramps
from urdyn.bench.truth import Trials, Truth, surprise, trials, truths
from urdyn.simulate.paper import (
    FRICTION_INCREASE,
    HEALTH_DEGRADATION,
    HEALTHY,
    NOISE_LEVELS,
    PAPER_GAIN,
    WORN,
    Life,
    Scenario,
    live,
    reconstruction,
)

__all__ = [
    "ALGORITHMS",
    "CONFIGURATIONS",
    "FAULTS",
    "FRICTION_INCREASE",
    "GROUPS",
    "HEALTHY",
    "HEALTH_DEGRADATION",
    "NOISE_LEVELS",
    "PAPER_GAIN",
    "WORN",
    "Followed",
    "Group",
    "Life",
    "Ramps",
    "Scenario",
    "Tracked",
    "Trials",
    "Truth",
    "VirtualArm",
    "follow_friction",
    "follow_health",
    "groups",
    "live",
    "ramps",
    "reconstruction",
    "surprise",
    "trials",
    "truths",
    "virtual_run",
]
