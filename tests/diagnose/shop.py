"""A virtual arm whose twin is known, broken in one way or another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from realarm import grown, with_current

from urdyn.diagnose import Diagnosis, Report, diagnose
from urdyn.identify import Fit
from urdyn.model.dynamics import Dynamics
from urdyn.signal import condition
from urdyn.simulate import happening, observe, parse_fault, plan, typical_sensors
from urdyn.types import Log


@dataclass(frozen=True, eq=False)
class Shop:
    """An arm and its twin."""

    dynamics: Dynamics
    fit: Fit

    def log(
        self, *faults: str, seconds: float = 40.0, rate: float = 50.0, seed: int = 5, **how: str
    ) -> Log:
        """A run in which all these faults befall the arm."""
        motion, noise = np.random.default_rng(seed).spawn(2)
        work = plan(how.get("motion", "fourier"), self.dynamics.arm, seconds, rate, motion)
        events = tuple(parse_fault(fault, self.dynamics.arm.joints) for fault in faults)
        lived = happening(self.dynamics, work, events, False)
        return observe(
            self.dynamics, work.trajectory, typical_sensors(self.dynamics.arm), noise, lived
        )

    def disturbed(self, log: Log, joint: int, torque: np.ndarray) -> Report:
        """What is told where a joint's current has this torque (N,) [N·m] in it besides."""
        current = log.joint("actual_current").copy()
        current[:, joint] += torque / self.dynamics.drive.gain[joint]
        return diagnose(self.fit, with_current(log, current))

    def report(self, *faults: str, **how) -> Report:
        """What is told of it."""
        return diagnose(self.fit, self.log(*faults, **how))

    def grown(self, log: Log, joint: int, coulomb: float, viscous: float, since: float) -> float:
        """By how much all friction of a joint grows where two terms do, as `grown` has it."""
        motion, _, _ = self.motion(log)
        return grown(motion, self.dynamics, joint, coulomb, viscous, since)

    def diagnosis(self, log: Log) -> Diagnosis:
        """Its settings for a log."""
        return Diagnosis(self.fit, float(np.median(np.diff(log.t))))

    def motion(self, log: Log):
        """Motion, presliding state and travel, as a diagnosis takes them."""
        motion = condition(log, offset=self.fit.dynamics.drive.time_offset)
        follow = self.fit.dynamics.bristles(motion)
        return motion, follow.together(self.fit.dynamics.drive.presliding_tail), follow.travelled
