"""Faults: found early, at a false-alarm rate that is promised in advance and kept.

    from urdyn.faults import detect
    found = detect(friction, friction_when_new, promise=10_000)    # one false alarm in 10,000 steps
    found.alarm, found.stream, found.onset

A detector is settings with `init` and `step`, as a filter is; `Whitened` puts one behind a baseline
that `learn_baseline` learnt from healthy data.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.faults.alternatives import Cells, cells
    from urdyn.faults.detector import Detection, Detector, Verdict, run
    from urdyn.faults.sequential import ShiryaevRoberts, promised_steps
    from urdyn.faults.series import detect
    from urdyn.faults.whiten import Baseline, learn_baseline, stated_baseline
    from urdyn.faults.whitened import Whitened

__all__ = [
    "Baseline",
    "Cells",
    "Detection",
    "Detector",
    "ShiryaevRoberts",
    "Verdict",
    "Whitened",
    "cells",
    "detect",
    "learn_baseline",
    "promised_steps",
    "run",
    "stated_baseline",
]

__getattr__ = lookup(
    __name__,
    {
        "urdyn.faults.alternatives": ("Cells", "cells"),
        "urdyn.faults.series": ("detect",),
        "urdyn.faults.detector": ("Detection", "Detector", "Verdict", "run"),
        "urdyn.faults.sequential": ("ShiryaevRoberts", "promised_steps"),
        "urdyn.faults.whiten": ("Baseline", "learn_baseline", "stated_baseline"),
        "urdyn.faults.whitened": ("Whitened",),
    },
)
