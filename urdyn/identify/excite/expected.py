"""The information to expect from a run: standard deviations before and after.

It is what identification would compute for the same run, with all rows, the noise's colour and
presliding, independent of the optimiser's own, faster sum.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urdyn.identify.compress import compress
from urdyn.identify.excite.question import Question
from urdyn.identify.expressions import physical
from urdyn.identify.map_estimate import build_problem, data_information
from urdyn.simulate.trajectory import Trajectory, grid
from urdyn.types import Array, Parameters, freeze


@dataclass(frozen=True, eq=False)
class Expected:
    """Physical parameters, and how well they are known before and after a run."""

    parameters: Parameters  # (Q,) at the point
    before: Array  # (Q,) sd
    after: Array  # (Q,) sd
    information: Array  # (P, P) in scores, after

    def __post_init__(self) -> None:
        freeze(self, "before", "after", "information")

    def gained(self) -> Array:
        """Share of the variance that the run removes, (Q,) [-]."""
        known = np.where(self.before > 0.0, self.before, 1.0)
        return np.asarray(np.where(self.before > 0.0, 1.0 - (self.after / known) ** 2, 0.0))


def expected(question: Question, trajectory: Trajectory) -> Expected:
    """What a log of `trajectory` would show, from all rows that count."""
    point, unknowns, z = question.point, question.unknowns, question.scores
    rate = min(question.rate, 1.0 / trajectory.step)
    motion = trajectory.at(grid(len(trajectory) * trajectory.step, rate))
    motion = replace(motion, current=point.current(motion))
    payload = 0 if unknowns.payloads else None
    blocks = compress(point, motion, question.noise.at(1.0 / rate).counted, payload)
    M = question.known + data_information(build_problem(unknowns, blocks, point), z)
    parameters, jacobian = physical(unknowns, z)
    return Expected(parameters, _sd(jacobian, question.known), _sd(jacobian, M), M)


def _sd(jacobian: Array, information: Array) -> Array:
    cov = np.linalg.inv(information)
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", jacobian, cov, jacobian)))
