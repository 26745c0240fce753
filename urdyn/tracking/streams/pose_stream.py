"""Poses at any rate: what they tell of geometry and of joints' zeros.

The controller's own pose follows from its encoders by its own calibration. It shows that
calibration and the configured tool; an encoder that slips moves angle and pose together, so it says
nothing of a joint's zero. A tracker beside the arm sees the arm itself: theta + k of every joint,
in an unknown frame and with an unknown target, which are estimated with the rest.

One surprising pose may be a gross error; two in a row mean that something has moved: for a tracker,
a joint's zero; for the controller, its configured tool.
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
from urdyn.tracking.streams.conditional_filter import (
    ConditionalBelief,
    LinearisedObservation,
    SharedMeasurement,
    measurement,
    updated,
    updated_noise,
    whitened,
)
from urdyn.tracking.streams.pose_belief import FINEST, Build, Sights, begun, nothing_seen
from urdyn.tracking.streams.stream import NO_STATES
from urdyn.types import Array, Gaussian, Mask

ENOUGH, OWN = 25, 8  # poses to estimate base and tool from; the controller's base is known
MOST = 200  # most poses kept for that
APART = 0.05  # [rad] of motion of some joint, after which the arm's small errors differ
PACE = 0.25  # [s] between two of the controller's own poses, of which every sample has one
STANDING = 1e-3  # [rad/s]
SOONEST = 1e-5  # [s] stamps' resolution
SURPRISED = 25.0  # [-] where 1 is expected: five standard deviations in every row on average
SLIPPED = 0.02  # [rad] sd of an encoder's slip
STRAY = 5e-6  # [rad/√s] of a joint's zero while a tracker watches
STEPS = 3  # iterations on a slip, as the pose is nonlinear within it
MEMORY = 300.0  # poses that noise is averaged over
TOOL = 6  # coordinates of a pose; the last ones of a placement
# A row after its stamp: place [m], turn [rad], both; and the controller's own angles [rad].
PLACE, TURN, POSE, ANGLES = slice(1, 4), slice(4, 7), slice(1, 7), slice(7, None)


@dataclass(frozen=True, eq=False)
class PoseStream:
    """Learns geometry and zeros from poses; its state is a `Sights`."""

    build: Build
    name: str = "pose"

    @property
    def width(self) -> int:
        """Width of a row: stamp and pose; for the controller's own, the pose's angles too."""
        return POSE.stop + len(self.build.start.table) * self.build.own

    @property
    def shared(self) -> str:
        """The joints' zeros; nothing where the poses are the controller's."""
        return "" if self.build.own else "k"

    @property
    def own(self) -> RandomWalk:
        """None: poses are nonlinear in what they alone measure, which is kept in `Sights`."""
        return NO_STATES

    def init(self) -> Sights:
        """The state before any pose; a controller's pose and angles share one stamp."""
        nothing = nothing_seen(len(self.build.start.table))
        return replace(nothing, late=0.0) if self.build.own else nothing

    def take(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[Sights, SharedMeasurement | None]:
        """Take one pose, `row` (width,); also returns it as a measurement of the zeros z."""
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
        """The state once the belief in the joints' zeros has changed, for whatever reason."""
        if not sights.count:
            return sights
        step, conditional = sights.conditional.settled(z)
        return self.build.moved(replace(sights, conditional=conditional), step)

    def _elsewhere(self, sights: Sights, now: Instant) -> bool:
        """Whether the arm moved or stopped: at the same pose, the same errors would count twice."""
        if np.isnan(sights.q).any() or now.t < sights.t:
            return True
        if self.build.own and now.t - sights.t < PACE:
            return False
        stopped = not sights.still and float(np.abs(now.v).max()) < STANDING
        return stopped or float(np.abs(now.q - sights.q).max()) > APART

    def _gathered(self, sights: Sights, now: Instant, row: Array, z: Gaussian) -> Sights:
        """With one more pose to estimate base and tool from."""
        seen = np.concatenate([now.q, row[POSE]])
        sights = replace(sights, gathered=np.vstack([sights.gathered, seen]))
        few = OWN if self.build.own else ENOUGH
        if len(sights.gathered) % few:
            return sights
        left = sights.gathered[few - MOST :]  # if they do not suffice, keep the last
        return begun(self.build, sights, z) or replace(sights, gathered=left)

    def _linearised(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[LinearisedObservation, Array]:
        """The pose, linearised, and its rate of change (m,) [m/s, rad/s]."""
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
        """Update geometry with the pose, and return it for the currents' filter."""
        shared = measurement(sights.conditional, observation, jump) if self.shared else None
        step, conditional = updated(sights.conditional, observation)
        sights = replace(sights, conditional=conditional, count=sights.count + 1.0)
        return self.build.moved(sights, step), shared

    def _moved_on(
        self, sights: Sights, now: Instant, row: Array, z: Gaussian
    ) -> tuple[Sights, SharedMeasurement | None]:
        """The state after two surprising poses in a row: something has moved."""
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
        """The pose, linearised about the zeros that it implies, which are far from z."""
        at, P = z.mean, sights.conditional.spread
        for _ in range(STEPS):
            observation, _ = self._linearised(sights, now, row, replace(z, mean=at))
            observation = replace(observation, e=observation.e + observation.Hz @ (at - z.mean))
            A = observation.regressor(sights.conditional)
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
        """One per name."""
        frames = 1 if self.build.own else 2
        return (*self.build.start.form.units, *["m"] * (3 * frames))

    def touching(self, sights: Sights, t: float) -> bool:
        """No pose shows contact."""
        return False

    def estimates(self, sights: Sights) -> tuple[Array, Array]:
        """Deviations from the drawing, and places of base and tool; NaN before they are known."""
        if not sights.count:
            return np.full(len(self.names), np.nan), np.full(len(self.names), np.nan)
        at = self.build.placement(sights)
        frames = [at.tool[:3, 3]] if self.build.own else [at.base[:3, 3], at.tool[:3, 3]]
        cov, first = np.array(sights.conditional.whole), len(at.deviations)
        if not self.build.own:  # the base's states are in its own axes
            turn, place = at.base[:3, :3], slice(first, first + 3)
            cov[place, place] = turn @ cov[place, place] @ turn.T
        sd = np.sqrt(np.maximum(np.diag(cov), 0.0))
        return np.concatenate([at.deviations, *frames]), sd[self._spoken]

    @cached_property
    def _spoken(self) -> Mask:
        """Which of the states have a name: of a frame, only its place."""
        mask = np.ones(len(self.build.columns), dtype=bool)
        first = len(self.build.prior.mean)
        for frame in range(first, len(mask), 6):
            mask[frame + 3 : frame + 6] = False
        return mask


def _heard(sights: Sights, observation: LinearisedObservation, passing: Array) -> Sights:
    """With the poses' noise, and the error of their stamps, updated by one more pose."""
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
    """The belief after another tool was configured, of which nothing is known."""
    cov = np.array(conditional.cov)
    cov[-TOOL:], cov[:, -TOOL:] = 0.0, 0.0
    cov[-TOOL:, -TOOL:] = ANYWHERE**2 * np.eye(TOOL)
    return replace(conditional, cov=cov)
