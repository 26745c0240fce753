"""A virtual arm whose twin is known, broken in one way or another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from realarm import with_current

from urdyn.diagnose import Diagnosis, Report, diagnose
from urdyn.identify import Fit
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import features, travel
from urdyn.signal import condition
from urdyn.simulate import happening, observe, parse_fault, plan, typical_sensors
from urdyn.tracking.passage import STANDING
from urdyn.types import Log


@dataclass(frozen=True)
class Shop:
    """An arm and its twin."""

    dynamics: Dynamics
    fit: Fit

    def log(
        self, *faults: str, seconds: float = 40.0, rate: float = 100.0, seed: int = 5, **how: str
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
        """By how much all friction of a joint grows where two of its terms do [-].

        Args:
            since: stamp from which on the motion counts [s].
        """
        motion, s, _ = self.motion(log)
        load = self.dynamics.arm.regressor(motion.q, motion.v, motion.a) @ (
            self.dynamics.loaded().ravel()
        )
        drive, slides = self.dynamics.drive, np.abs(motion.v[:, joint]) > STANDING
        terms = features(motion, load, s, drive)
        way = np.sign(motion.v[:, joint]) * (slides & (motion.t >= since))
        torque = {
            name: float(way @ (getattr(drive, name) * terms[name])[:, joint])
            for name in ("coulomb", "viscous", "structural", "stribeck")
        }
        more = coulomb * torque["coulomb"] + viscous * torque["viscous"]
        return more / sum(torque.values())

    def diagnosis(self, log: Log) -> Diagnosis:
        """Its settings for a log."""
        return Diagnosis(self.fit, float(np.median(np.diff(log.t))))

    def motion(self, log: Log):
        """Motion, presliding state and travel, as a diagnosis takes them."""
        motion = condition(log, offset=self.fit.dynamics.drive.time_offset)
        moved = np.cumsum(np.abs(travel(motion)), axis=0)
        return motion, self.fit.dynamics.presliding(motion), moved
