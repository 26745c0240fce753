"""Poses as they come, at whatever rate: what they tell of geometry, and of joints' zeros.

The controller's own pose follows from its encoders by its own calibration. It tells that
calibration, and the tool that it was told of; an encoder that slips moves angle and pose together,
so of a joint's zero it says nothing. A tracker beside the arm sees the arm itself: theta + k of
every joint, in a frame and of a target that nobody knows, so that they are found with the rest.

A pose that surprises may be a gross error; two in a row, and something has moved: of a tracker's,
a joint's zero; of the controller's, the tool that it was told of.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.process import RandomWalk
from urdyn.identify.kinematics.placement import residuals, slopes
from urdyn.identify.kinematics.spread import ANYWHERE
from urdyn.io.poses import READINGS, Poses
from urdyn.signal import Instant
from urdyn.tracking.conditional_filter import (
    ConditionalBelief,
    LinearisedObservation,
    SharedMeasurement,
    measurement,
    updated,
    updated_noise,
    whitened,
)
from urdyn.tracking.sights import FINEST, Build, Sights, begun, nothing_seen
from urdyn.tracking.streams import NO_STATES
from urdyn.types import Array, Gaussian, Mask

ENOUGH, OWN = 25, 8  # poses that base and tool are sought from; the controller's base is known
MOST = 200  # that are kept for that
APART = 0.05  # [rad] a joint has moved: the arm's small errors are others there
PACE = 0.25  # [s] between two of the controller's own, which has one with every sample
STANDING = 1e-3  # [rad/s]
SOONEST = 1e-5  # [s] stamps are no finer
SURPRISED = 25.0  # [-] where 1 is expected: five standard deviations in every row
SLIPPED = 0.02  # [rad] sd of what an encoder that slips is off by
STRAY = 5e-6  # [rad/√s] of a joint's zero while a tracker looks on
STEPS = 3  # by which a slip is approached: a pose bends within it
MEMORY = 300.0  # poses that noise is averaged over
TOOL = 6  # coordinates of a pose, and the last of a placement's
# Of a row, behind its stamp: place [m], turn [rad], both; and the controller's own angles [rad].
PLACE, TURN, POSE, ANGLES = slice(1, 4), slice(4, 7), slice(1, 7), slice(7, None)


@dataclass(frozen=True, eq=False)
class PoseStream:
    """Learns geometry and zeros from poses; what was seen is in the `Sights` it passes on."""

    build: Build
    name: str = "pose"

    @property
    def width(self) -> int:
        """Stamp and pose; and of the controller's own, the angles that it is of."""
        return POSE.stop + len(self.build.start.table) * self.build.own

    @property
    def shared(self) -> str:
        """The joints' zeros; nothing where the poses are the controller's."""
        return "" if self.build.own else "k"

    @property
    def own(self) -> RandomWalk:
        """None: a pose bends with what it alone tells of."""
        return NO_STATES

    def init(self) -> Sights:
        """Nothing seen; a controller's pose and angles are of one moment."""
        nothing = nothing_seen(len(self.build.start.table))
        return replace(nothing, late=0.0) if self.build.own else nothing

    def take(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[Sights, SharedMeasurement | None]:
        """One pose on, `row` (width,); what it is to those who believe in the zeros z."""
        now = replace(now, q=row[ANGLES]) if self.build.own else now
        known = np.isfinite(row[PLACE]).all() and np.isfinite(now.q).all()
        if not known or not self._elsewhere(sights, now):
            return sights, None
        dt = now.t - sights.t
        still = bool(np.abs(now.v).max() < STANDING)
        sights = replace(sights, q=now.q, still=still, t=now.t)
        if not sights.count:
            return self._gathered(sights, now, row, z), None
        conditional = sights.conditional.after_drift(STRAY**2 * max(dt, 0.0) * np.eye(len(z.mean)))
        sights = self.settled(replace(sights, conditional=conditional), z)
        observation, passing = self._linearised(sights, now, row, z)
        if observation.surprise(sights.conditional) < SURPRISED:
            sights = replace(_heard(sights, observation, passing), doubted=0)
            return self._learnt(sights, observation, np.zeros(len(z.mean)))
        if not sights.doubted:
            return replace(sights, doubted=1), None
        return self._moved_on(replace(sights, doubted=0), now, row, z)

    def settled(self, sights: Sights, z: Gaussian) -> Sights:
        """After the joints' zeros have been told of by whomever."""
        if not sights.count:
            return sights
        step, conditional = sights.conditional.settled(z)
        return self.build.moved(replace(sights, conditional=conditional), step)

    def _elsewhere(self, sights: Sights, now: Instant) -> bool:
        """Where the arm still stands, or nearly, the same errors would count twice."""
        if np.isnan(sights.q).any() or now.t < sights.t:
            return True
        if self.build.own and now.t - sights.t < PACE:
            return False
        stopped = not sights.still and float(np.abs(now.v).max()) < STANDING
        return stopped or float(np.abs(now.q - sights.q).max()) > APART

    def _gathered(self, sights: Sights, now: Instant, row: Array, z: Gaussian) -> Sights:
        """One more of those that base and tool are sought from."""
        seen = np.concatenate([now.q, row[POSE]])
        sights = replace(sights, gathered=np.vstack([sights.gathered, seen]))
        few = OWN if self.build.own else ENOUGH
        if len(sights.gathered) % few:
            return sights
        left = sights.gathered[few - MOST :]  # of those that do not tell, the last, and a few more
        return begun(self.build, sights, z) or replace(sights, gathered=left)

    def _linearised(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[LinearisedObservation, Array]:
        """The pose, linearised, and the twist (m,) at which it passes [m/s, rad/s]."""
        at, q = self.build.placement(sights), now.q[None]
        acting = q + z.mean if len(z.mean) else q
        pose = self._pose(sights, acting, row)
        e = residuals(at, acting, pose.place, pose.turn)[0]
        known = np.isfinite(e)
        H = slopes(at, acting)[0]
        turning = H[:, self.build.zeros]
        passing = turning @ now.v
        R = np.diag(np.repeat(sights.noise, 3) ** 2) + sights.late**2 * np.outer(passing, passing)
        Hs, Hz = H[:, self.build.columns], turning[:, : len(z.mean)]
        return LinearisedObservation(
            e[known], Hs[known], Hz[known], R[np.ix_(known, known)]
        ), passing[known]

    def _pose(self, sights: Sights, q: Array, row: Array) -> Poses:
        angles = row[None, TURN] if np.isfinite(row[TURN]).all() else None
        return Poses(q, row[None, PLACE], angles, READINGS[sights.reading], self.build.own)

    def _learnt(
        self, sights: Sights, observation: LinearisedObservation, jump: Array
    ) -> tuple[Sights, SharedMeasurement | None]:
        """The pose taken up by both sides."""
        shared = measurement(sights.conditional, observation, jump) if self.shared else None
        step, conditional = updated(sights.conditional, observation)
        sights = replace(sights, conditional=conditional, count=sights.count + 1.0)
        return self.build.moved(sights, step), shared

    def _moved_on(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[Sights, SharedMeasurement | None]:
        """Two poses in a row agree that something has moved."""
        if self.shared:
            jump = np.full(len(z.mean), SLIPPED)
            sights = replace(sights, conditional=sights.conditional.after_drift(np.diag(jump**2)))
            return self._learnt(sights, self._bent(sights, now, row, z), jump)
        pose = self._pose(sights, now.q[None], row)
        if pose.angles is None:
            return sights, None
        flange = self.build.placement(sights).flanges(now.q[None])[0]
        there = np.eye(4)
        there[:3, :3], there[:3, 3] = pose.turn[0], pose.place[0]
        tool = np.linalg.solve(sights.base @ flange, there)
        return replace(sights, tool=tool, conditional=_another_tool(sights.conditional)), None

    def _bent(self, sights: Sights, now: Instant, row: Array, z: Gaussian) -> LinearisedObservation:
        """The pose, linearised where it says that the zeros are: they are far from z."""
        at, P = z.mean, sights.conditional.spread
        for _ in range(STEPS):
            observation, _ = self._linearised(sights, now, row, replace(z, mean=at))
            observation = replace(observation, e=observation.e + observation.Hz @ (at - z.mean))
            A = observation.Hs @ sights.conditional.L + observation.Hz
            gain = np.linalg.solve(observation.expected(sights.conditional), A @ P).T
            at = z.mean + gain @ observation.e
        return observation

    @cached_property
    def names(self) -> tuple[str, ...]:
        """ "kinematics.elbow_joint.beta", ..., "kinematics.tool.x", ..."""
        frames = ("tool",) if self.build.own else ("base", "tool")
        placed = [f"{frame}.{axis}" for frame in frames for axis in ("x", "y", "z")]
        return tuple(f"kinematics.{name}" for name in (*self.build.start.form.names, *placed))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """One a name."""
        frames = 1 if self.build.own else 2
        return (*self.build.start.form.units, *["m"] * (3 * frames))

    def estimates(self, sights: Sights) -> tuple[Array, Array]:
        """Deviations from the drawing, and where base and tool are; NaN before that is known."""
        if not sights.count:
            return np.full(len(self.names), np.nan), np.full(len(self.names), np.nan)
        at = self.build.placement(sights)
        frames = [at.tool[:3, 3]] if self.build.own else [at.base[:3, 3], at.tool[:3, 3]]
        cov, first = np.array(sights.conditional.whole), len(at.deviations)
        if not self.build.own:  # a step of the base is in its own axes
            turn, place = at.base[:3, :3], slice(first, first + 3)
            cov[place, place] = turn @ cov[place, place] @ turn.T
        sd = np.sqrt(np.maximum(np.diag(cov), 0.0))
        return np.concatenate([at.deviations, *frames]), sd[self._spoken]

    @cached_property
    def _spoken(self) -> Mask:
        """Which of the states have a name: of a frame, its place."""
        mask = np.ones(len(self.build.columns), dtype=bool)
        first = len(self.build.prior.mean)
        for frame in range(first, len(mask), 6):
            mask[frame + 3 : frame + 6] = False
        return mask


def _heard(sights: Sights, observation: LinearisedObservation, passing: Array) -> Sights:
    """The poses' noise, and how far off their stamps are, after one more pose."""
    W, white = whitened(sights.conditional, observation)
    gain, late = 1.0 / min(sights.count + 1.0, MEMORY), sights.late**2
    steady, seen = float(passing @ W @ passing), float(passing @ white)
    held = late - late**2 * steady + (late * seen) ** 2
    squares = updated_noise(sights.noise**2, sights.conditional, observation, gain)
    return replace(
        sights,
        noise=np.sqrt(np.maximum(squares, FINEST**2)),
        late=float(np.sqrt(max(late + gain * (held - late), SOONEST**2))) if late else 0.0,
    )


def _another_tool(conditional: ConditionalBelief) -> ConditionalBelief:
    """The controller was told of another tool: of that, nothing is known."""
    cov = np.array(conditional.cov)
    cov[-TOOL:], cov[:, -TOOL:] = 0.0, 0.0
    cov[-TOOL:, -TOOL:] = ANYWHERE**2 * np.eye(TOOL)
    return replace(conditional, cov=cov)
