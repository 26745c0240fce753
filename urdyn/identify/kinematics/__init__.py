"""Poses -> Calibration: how an arm's geometry deviates from its drawing, with uncertainty."""

from urdyn.identify.kinematics.calibration import Calibration, calibrate
from urdyn.identify.kinematics.choose_poses import most_informative
from urdyn.identify.kinematics.evaluation import Evaluation, evaluate
from urdyn.identify.kinematics.record import Recorded, document, load_calibration

__all__ = [
    "Calibration",
    "Evaluation",
    "Recorded",
    "calibrate",
    "document",
    "evaluate",
    "load_calibration",
    "most_informative",
]
