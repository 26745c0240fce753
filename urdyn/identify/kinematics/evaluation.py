"""How well an earlier calibration explains other poses, with only base and tool refitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urdyn.identify.kinematics.calibration import (
    drawn,
    everything,
    rank_at,
    refitted,
    require_this_arm,
    rms,
    sound,
    usable,
)
from urdyn.identify.kinematics.record import Recorded
from urdyn.identify.kinematics.robust import Found, begin
from urdyn.io.poses import Poses
from urdyn.model.arm import Arm
from urdyn.model.geometry.drawing import Drawing, drawing_of
from urdyn.types import Mask

NOMINAL, ALONE, FULL = "nominal", "geometry", "geometry and joints"


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Fits of base and tool to poses, by model of the arm."""

    arm: Arm
    drawing: Drawing
    poses: Poses
    fits: dict[str, Found]  # NOMINAL, ALONE and, where the calibration has it, FULL
    rank: int  # of all unknowns, with these poses
    sought: int

    @property
    def best(self) -> str:
        """The calibration's model that explains these poses better."""
        models = [name for name in self.fits if name != NOMINAL]
        return min(models, key=lambda name: rms(self.fits[name], self.sound))

    @property
    def sound(self) -> Mask:
        """(N,) poses that are not gross errors, by the calibration's geometry."""
        return sound(self.fits[ALONE])


def evaluate(arm: Arm, poses: Poses, recorded: Recorded, seed: int = 0) -> Evaluation:
    """Score a calibration on `poses`."""
    poses, drawing = usable(arm, poses), drawing_of(arm)
    start, poses = begin(drawn(arm, drawing), poses, np.random.default_rng(seed))
    placements = {NOMINAL: start, ALONE: recorded.geometric}
    if recorded.full is not None:
        placements[FULL] = recorded.full
    fits = {}
    for name, placement in placements.items():
        rng = np.random.default_rng(seed)
        begun, _ = begin(placement, poses, rng)
        fits[name] = refitted(begun, poses, rng)
    require_this_arm(fits[NOMINAL], arm, poses)
    sought = everything(start, poses)
    rank = rank_at(fits[ALONE], sought, poses)[0]
    return Evaluation(arm, drawing, poses, fits, rank, len(sought.columns))
