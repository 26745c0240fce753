"""The wrench at the flange as it comes: what the arm carries, weighed by the force sensor.

    w = b - Y(q, v, a) (pi - c)        Y: of the last body, by recursive Newton-Euler

pi is the payload that the currents tell of as well. b is what the sensor shows of nothing, tens of
newtons on arms at work, and c what the controller compensates for, which may be anything: with both
unknown, a wrench tells of a payload that changes, and then of how much. Of a raw wrench c is the
tool that is in the arm's model, the other way round: it shows that, too. A
compensated one is told about a tool that nobody named, so that its moments are left out. A row that
surprises is a contact; where all do for a while, b and c have been set anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from urdyn.model.arm import Arm, controller_base
from urdyn.signal import Instant
from urdyn.tracking.conditional_filter import (
    ConditionalBelief,
    LinearisedObservation,
    SharedMeasurement,
    measurement,
    updated,
    updated_noise,
)
from urdyn.tracking.model import PAYLOAD_SD
from urdyn.types import Array, Gaussian, frozen

PACE = 0.1  # [s] between two rows that are looked at: noise of the sensor is slow
BIAS_SD = np.repeat([100.0, 10.0], 3)  # [N, N·m]
BIAS_WALK = np.repeat([0.05, 0.005], 3)  # [N/√s, N·m/√s] as it warms
NOISE = np.array([2.0, 0.1])  # [N, N·m] before data tell: sensor, and accelerations
FINEST = np.array([0.1, 0.005])  # [N, N·m]
MEMORY = 300.0  # rows that noise is averaged over
CONTACT = 16.0  # [-] where 1 is expected: four standard deviations in every row
ANEW = 30  # rows in a row that surprise: no contact lasts
AXES = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class Felt:
    """All that is remembered of a force sensor."""

    own: Array  # (16,) b [N, N·m] and c, as believed
    conditional: ConditionalBelief  # of these
    noise: Array  # (2,) sd [N, N·m]
    t: float  # [s] of the last row that was looked at; -inf: none was
    count: float  # rows that taught
    doubted: int  # rows in a row that surprised
    last: Array  # (6,) the row that was looked at; NaN: none was

    def __post_init__(self) -> None:
        for name in ("own", "noise", "last"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True, eq=False)
class WrenchStream:
    """Weighs what is carried by the force sensor; what was felt is in the `Felt` it passes on."""

    arm: Arm
    raw: bool  # in the flange's axes with all that it carries; else compensated, in the base's
    shared: str = "payload"
    width: int = 7
    tool: Array = field(default_factory=lambda: np.zeros(10))  # that the payload does not count

    @property
    def name(self) -> str:
        """Which of a sample's streams."""
        return "raw_wrench" if self.raw else "wrench"

    @property
    def names(self) -> tuple[str, ...]:
        """What the sensor shows of nothing."""
        return tuple(f"sensor.{axis}" for axis in AXES[: self._rows])

    @property
    def units(self) -> tuple[str, ...]:
        """One a name."""
        return (*["N"] * 3, *["N·m"] * 3)[: self._rows]

    @property
    def _rows(self) -> int:
        return 6 if self.raw else 3

    @cached_property
    def _root_to_base(self) -> Array:
        return np.asarray(controller_base(self.arm)[:3, :3].T)

    @property
    def _before(self) -> Array:
        """Covariance of b and c before the first row, (16, 16)."""
        return np.diag(np.r_[BIAS_SD, PAYLOAD_SD * (not self.raw)] ** 2)

    def init(self) -> Felt:
        """Nothing felt."""
        nothing = np.zeros(len(PAYLOAD_SD))
        conditional = ConditionalBelief(
            np.zeros((16, 10)), self._before, nothing, np.diag(PAYLOAD_SD**2)
        )
        return Felt(
            own=np.concatenate([np.zeros(6), -self.tool * self.raw]),
            conditional=conditional,
            noise=NOISE,
            t=-np.inf,
            count=0.0,
            doubted=0,
            last=np.full(6, np.nan),
        )

    def take(
        self, felt: Felt, now: Instant, row: Array, z: Gaussian, widened: float
    ) -> tuple[Felt, SharedMeasurement | None]:
        """One row on, `row` (7,); what it is to those who believe in the payload z."""
        dt = now.t - felt.t
        if not np.isfinite(row[1:]).all() or 0.0 <= dt < PACE:
            return felt, None
        if np.array_equal(row[1:], felt.last):  # no sensor that works shows the same twice
            return replace(felt, t=now.t), None
        jumped = widened > felt.t
        felt = _strayed(felt, dt if np.isfinite(dt) else 0.0, jumped)
        felt = self.settled(replace(felt, t=now.t, last=row[1:]), z)
        observation = self._linearised(felt, now, row[1:], z)
        if observation.surprise(felt.conditional) > CONTACT:
            return self._doubted(felt), None
        gain = 1.0 / min(felt.count + 10.0, MEMORY)
        squares = updated_noise(felt.noise**2, felt.conditional, observation, gain)
        shared = measurement(felt.conditional, observation, np.zeros(len(z.mean)))
        step, conditional = updated(felt.conditional, observation)
        noise = np.sqrt(np.maximum(squares, FINEST**2))
        own, count = felt.own + step, felt.count + 1.0
        return replace(
            felt, own=own, conditional=conditional, noise=noise, count=count, doubted=0
        ), shared

    def settled(self, felt: Felt, z: Gaussian) -> Felt:
        """After the payload has been told of by whomever."""
        step, conditional = felt.conditional.settled(z)
        return replace(felt, own=felt.own + step, conditional=conditional)

    def estimates(self, felt: Felt) -> tuple[Array, Array]:
        """What the sensor shows of nothing; NaN before it has shown anything."""
        unknown = 1.0 if felt.count else np.nan
        sd = np.sqrt(np.diag(felt.conditional.whole))[: self._rows]
        return unknown * felt.own[: self._rows], unknown * sd

    def _linearised(
        self, felt: Felt, now: Instant, wrench: Array, z: Gaussian
    ) -> LinearisedObservation:
        Y = self.arm.wrench_regressor(now.q, now.v, now.a)
        seen = wrench if self.raw else self._into_flange(now.q, wrench)
        Hs, Hz = np.hstack([np.eye(6), Y]), -Y
        R = np.diag(np.repeat(felt.noise**2, 3))
        e, few = seen - Hs @ felt.own - Hz @ z.mean, slice(self._rows)
        return LinearisedObservation(e[few], Hs[few], Hz[few], R[few, few])

    def _into_flange(self, q: Array, wrench: Array) -> Array:
        """A wrench in the base's axes, (6,), in the last joint's."""
        turn = self._root_to_base @ self.arm.pose(q, self.arm.link_names[-1])[:3, :3]
        return np.concatenate([turn.T @ wrench[:3], turn.T @ wrench[3:]])

    def _doubted(self, felt: Felt) -> Felt:
        """A contact; or, after so many, a sensor that was set anew."""
        if felt.doubted < ANEW:
            return replace(felt, doubted=felt.doubted + 1)
        conditional = replace(
            felt.conditional, L=np.zeros_like(felt.conditional.L), cov=self._before
        )
        return replace(felt, conditional=conditional, doubted=0)


def _strayed(felt: Felt, dt: float, jumped: bool) -> Felt:
    """After `dt` [s], in which another payload may have been taken up."""
    conditional = felt.conditional.after_drift(np.diag((PAYLOAD_SD * jumped) ** 2))
    walked = np.zeros_like(conditional.cov)
    walked[range(6), range(6)] = BIAS_WALK**2 * max(dt, 0.0)
    return replace(felt, conditional=replace(conditional, cov=conditional.cov + walked))
