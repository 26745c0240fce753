"""Faults: found early, at a false-alarm rate that is promised in advance and kept.

    from urdyn.faults import detect
    found = detect(friction, friction_when_new, promise=10_000)    # one false alarm in 10,000 steps
    found.alarm, found.stream, found.onset

A detector is settings with `init` and `step`, as a filter is; `Whitened` puts one behind a baseline
that `learn_baseline` learnt from healthy data. Algorithm 2 is given the series as it is:

    ours = tuned_algorithm2(friction_when_new, critical)    # or Algorithm2, by thresholds
    detect(friction, friction_when_new, detector=ours)    # run(ours, rows) without a baseline
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.faults.algorithm2 import Algorithm2, Status, tuned_algorithm2
    from urdyn.faults.alternatives import Cells, cells
    from urdyn.faults.cusum import Cusum
    from urdyn.faults.decision import Costs, Decision, decide, outlook
    from urdyn.faults.detector import Detection, Detector, Verdict, run
    from urdyn.faults.glr import GLR
    from urdyn.faults.onset import Kinks, follow, kinks
    from urdyn.faults.oracle import calibrated, oracle_cusum
    from urdyn.faults.prognosis import Forecast, Interval, forecast, foresee, health_index
    from urdyn.faults.sequential import ShiryaevRoberts
    from urdyn.faults.series import detect
    from urdyn.faults.whiten import Baseline, learn_baseline, stated_baseline
    from urdyn.faults.whitened import Whitened

__all__ = [
    "GLR",
    "Algorithm2",
    "Baseline",
    "Cells",
    "Costs",
    "Cusum",
    "Decision",
    "Detection",
    "Detector",
    "Forecast",
    "Interval",
    "Kinks",
    "ShiryaevRoberts",
    "Status",
    "Verdict",
    "Whitened",
    "calibrated",
    "cells",
    "decide",
    "detect",
    "follow",
    "forecast",
    "foresee",
    "health_index",
    "kinks",
    "learn_baseline",
    "oracle_cusum",
    "outlook",
    "run",
    "stated_baseline",
    "tuned_algorithm2",
]

__getattr__ = lookup(
    __name__,
    {
        "urdyn.faults.algorithm2": ("Algorithm2", "Status", "tuned_algorithm2"),
        "urdyn.faults.alternatives": ("Cells", "cells"),
        "urdyn.faults.glr": ("GLR",),
        "urdyn.faults.onset": ("Kinks", "follow", "kinks"),
        "urdyn.faults.oracle": ("calibrated", "oracle_cusum"),
        "urdyn.faults.prognosis": (
            "Forecast",
            "Interval",
            "forecast",
            "foresee",
            "health_index",
        ),
        "urdyn.faults.series": ("detect",),
        "urdyn.faults.cusum": ("Cusum",),
        "urdyn.faults.decision": ("Costs", "Decision", "decide", "outlook"),
        "urdyn.faults.detector": ("Detection", "Detector", "Verdict", "run"),
        "urdyn.faults.sequential": ("ShiryaevRoberts",),
        "urdyn.faults.whiten": ("Baseline", "learn_baseline", "stated_baseline"),
        "urdyn.faults.whitened": ("Whitened",),
    },
)
