"""The results in the paper's Tables I to IV. It gives no units for its errors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperGroup:
    """A row of Table I, and what its number can be compared with."""

    symbol: str
    name: str
    rmse: float
    steps: int  # until convergence
    comparable: str  # why its number can, or cannot, be compared with one in SI


@dataclass(frozen=True)
class PaperAlgorithm:
    """A row of Table II."""

    name: str
    rmse: float
    ms: float  # per update
    mb: float


@dataclass(frozen=True)
class PaperFault:
    """A row of Table III."""

    name: str
    found: float  # share of the faults
    false: float  # "FP rate", without saying of what
    steps: float  # from onset to alarm


@dataclass(frozen=True)
class PaperConfiguration:
    """A row of Table IV."""

    name: str
    mode: str  # its name in `urdyn track`
    hz: float
    mb: float


GROUPS = (
    PaperGroup("k", "kinematic", 0.032, 45, "rad, if the paper's are joint angles"),
    PaperGroup(
        "m",
        "mass",
        0.187,
        62,
        "no: in kg or as a share of what is unknown; and on a fixed base no single mass shows",
    ),
    PaperGroup("f", "friction", 0.058, 38, "on the scenario only: there eq. 7 gives the unit"),
    PaperGroup("alpha", "damping", 0.074, 72, "on the scenario only: there eq. 7 gives the unit"),
    PaperGroup("beta", "damping", 0.083, 68, "yes, if it is a ratio there as here"),
    PaperGroup("z", "health", 0.125, 55, "yes: a ratio, 1 when new"),
)
ALGORITHMS = (
    PaperAlgorithm("EKF", 0.087, 8.4, 84.0),
    PaperAlgorithm("UKF", 0.058, 24.7, 92.0),
    PaperAlgorithm("PF (1k particles)", 0.042, 125.3, 247.0),
    PaperAlgorithm("VI", 0.069, 67.8, 112.0),
)
FAULTS = (
    PaperFault("friction increase", 0.82, 0.12, 38.0),
    PaperFault("health degradation", 0.76, 0.15, 45.0),
    PaperFault("joint backlash", 0.63, 0.21, 72.0),
    PaperFault("controller instability", 0.69, 0.18, 54.0),
)
CONFIGURATIONS = (
    PaperConfiguration("Full Model", "full", 21.3, 148.0),
    PaperConfiguration("Simplified Model", "simplified", 35.6, 92.0),
    PaperConfiguration("Real-time Mode", "realtime", 48.2, 115.0),
)
LATE = 18  # its Figure 4: lag of the estimate, in steps
NOTICED, LOW = 38, 0.03  # the step at which it detects the fault; how far too low it reads after
SAID, AHEAD = 60, 20  # the step of its forecast, and the steps it predicts to the critical level
