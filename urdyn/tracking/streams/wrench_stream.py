"""The wrench at the flange: the payload, as weighed by the force sensor.

    w = b - Y(q, v, a) (pi - c)        Y: of the last body, by recursive Newton-Euler

pi is the payload, which the currents measure as well. b is the sensor's bias, tens of newtons on
arms at work, and c what the controller compensates for, which may be anything: with both unknown, a
wrench shows only changes of a payload. For a raw wrench, c is minus the tool in the arm's model,
which it measures too. A compensated one refers to the point of a tool that was not named, so that
its moments are left out. A surprising row is not learnt from; if all surprise for a while, b and c
have been set anew. Where no payload explains a raw row, the arm is in contact, which may last: then
its currents are not learnt from, either. Of a compensated wrench that is not known, since
controllers set b and c anew in the middle of a program.

b and c are states of the currents' filter. Payloads weighed by currents all share the same errors
of friction and gain, and b inherits these: if b were kept apart, conditional on the payload, each
payload would count as new information on it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from urdyn.dbn.process import RandomWalk
from urdyn.model.arm import Arm, controller_base
from urdyn.signal import Instant
from urdyn.tracking.belief.model import ANYTHING, PAYLOAD_SD
from urdyn.tracking.streams.conditional_filter import (
    LinearisedObservation,
    SharedMeasurement,
    measurement,
    nothing_besides,
    updated_noise,
)
from urdyn.types import Array, Gaussian, freeze

PACE = 0.1  # [s] between two rows that are used: the sensor's noise is slow
BIAS_SD = np.repeat([100.0, 10.0], 3)  # [N, N·m]
BIAS_WALK = np.repeat([0.05, 0.005], 3)  # [N/√s, N·m/√s] as the sensor warms up
NOISE = np.array([2.0, 0.1])  # [N, N·m] prior sd: sensor, and accelerations
FINEST = np.array([0.1, 0.005])  # [N, N·m]
MEMORY = 300.0  # rows to average the noise over
SURPRISE = 16.0  # [-] where 1 is expected: four standard deviations in every row on average
ANEW = 30  # surprising rows in succession: no piece takes so long to show in the currents
HELD = 1.0  # [s] for which a row tells contact, while no other comes
ANEW_TOUCHING = 600  # the same in contact: nobody works for a minute without lifting the tool
AXES = ("fx", "fy", "fz", "mx", "my", "mz")
LOAD = 4  # parameters that are compensated: no force shows inertia


@dataclass(frozen=True, eq=False)
class Felt:
    """All that is remembered of a force sensor."""

    noise: Array  # (2,) sd [N, N·m]
    t: float  # [s] of the last row used; -inf: none
    count: float  # rows learnt from
    doubted: int  # surprising rows in succession
    pressed: bool  # some of these in contact
    touching: bool  # in contact, after the last row used
    last: Array  # (6,) the last row used; NaN: none
    bias: Gaussian  # b [N, N·m], after the last row learnt from; NaN: none

    def __post_init__(self) -> None:
        freeze(self, "noise", "last")


@dataclass(frozen=True, eq=False)
class WrenchStream:
    """Weighs the payload by the force sensor; its state is a `Felt`."""

    arm: Arm
    raw: bool  # in the flange's axes and uncompensated; else compensated, in the base's
    shared: str = "payload"
    width: int = 7
    tool: Array = field(default_factory=lambda: np.zeros(10))  # not included in the payload

    @property
    def name(self) -> str:
        """Which of a sample's streams it is."""
        return "raw_wrench" if self.raw else "wrench"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sensor's bias."""
        return tuple(f"sensor.{axis}" for axis in AXES[: self._rows])

    @property
    def units(self) -> tuple[str, ...]:
        """One per name."""
        return (*["N"] * 3, *["N·m"] * 3)[: self._rows]

    @cached_property
    def own(self) -> RandomWalk:
        """b, and c where that is unknown."""
        sd, walk = BIAS_SD[: self._rows], BIAS_WALK[: self._rows]
        if not self.raw:
            sd, walk = np.r_[sd, PAYLOAD_SD[:LOAD]], np.r_[walk, np.zeros(LOAD)]
        names = tuple(f"sensor_{k}" for k in range(len(sd)))
        return RandomWalk(names, Gaussian(np.zeros(len(sd)), np.diag(sd**2)), walk)

    @property
    def _rows(self) -> int:
        return 6 if self.raw else 3

    @cached_property
    def _root_to_base(self) -> Array:
        return np.asarray(controller_base(self.arm)[:3, :3].T)

    def init(self) -> Felt:
        """The state before any row."""
        unknown = np.full(self._rows, np.nan)
        return Felt(
            noise=NOISE,
            t=-np.inf,
            count=0.0,
            doubted=0,
            pressed=False,
            touching=False,
            last=np.full(6, np.nan),
            bias=Gaussian(unknown, np.diag(unknown)),
        )

    def take(
        self, felt: Felt, now: Instant, row: Array, z: Gaussian
    ) -> tuple[Felt, SharedMeasurement | None]:
        """Take one row (7,); also returns it as a measurement of z: payload, b and c."""
        dt = now.t - felt.t
        if not np.isfinite(row[1:]).all() or 0.0 <= dt < PACE:
            return felt, None
        if np.array_equal(row[1:], felt.last):  # a working sensor never shows the same twice
            return replace(felt, t=now.t, touching=False), None
        felt, known = replace(felt, t=now.t, last=row[1:]), nothing_besides(z)
        observation, anew = self._linearised(felt, now, row[1:], z), np.zeros(len(z.mean))
        calm = replace(felt, doubted=0, pressed=False, touching=False)
        touching = self.raw and not self._carried(observation, z)
        if touching or observation.surprise(known) > SURPRISE:
            doubted, pressed = felt.doubted + 1, felt.pressed or touching
            if doubted <= (ANEW_TOUCHING if pressed else ANEW):
                return replace(felt, doubted=doubted, pressed=pressed, touching=touching), None
            anew[len(PAYLOAD_SD) :] = self.own.prior.sd
            return calm, measurement(known, observation, anew)
        gain = 1.0 / min(felt.count + 10.0, MEMORY)
        squares = updated_noise(felt.noise**2, known, observation, gain)
        noise = np.sqrt(np.maximum(squares, FINEST**2))
        felt = replace(calm, noise=noise, count=felt.count + 1.0)
        return felt, measurement(known, observation, anew)

    def settled(self, felt: Felt, z: Gaussian) -> Felt:
        """The state after the currents' filter was updated by the row."""
        at = slice(len(PAYLOAD_SD), len(PAYLOAD_SD) + self._rows)
        return replace(felt, bias=Gaussian(z.mean[at], z.cov[at, at]))

    def touching(self, felt: Felt, t: float) -> bool:
        """Whether no payload explains the last row, if that is not long ago."""
        return felt.touching and abs(t - felt.t) < HELD

    def _carried(self, observation: LinearisedObservation, z: Gaussian) -> bool:
        """Whether a payload explains a row: any, but for one that weighs less than nothing."""
        free = np.zeros(len(z.mean))
        free[: len(PAYLOAD_SD)] = ANYTHING * PAYLOAD_SD
        anything = replace(nothing_besides(z), spread=z.cov + np.diag(free**2))
        if observation.surprise(anything) > SURPRISE:
            return False
        N = observation.expected(anything)
        gain = np.linalg.solve(N, observation.Hz @ anything.spread[:, 0])
        mass = z.mean[0] + gain @ observation.e + self.tool[0]
        variance = anything.spread[0, 0] - gain @ N @ gain
        return bool(min(mass, 0.0) ** 2 < SURPRISE * variance)

    def estimates(self, felt: Felt) -> tuple[Array, Array]:
        """Bias of the sensor; NaN before its first row."""
        return felt.bias.mean, felt.bias.sd

    def _linearised(
        self, felt: Felt, now: Instant, wrench: Array, z: Gaussian
    ) -> LinearisedObservation:
        Y, few = self.arm.wrench_regressor(now.q, now.v, now.a), slice(self._rows)
        seen = wrench + Y @ self.tool if self.raw else self._into_flange(now.q, wrench)
        H = np.hstack([-Y, np.eye(6)[:, few], *([] if self.raw else [Y[:, :LOAD]])])[few]
        R = np.diag(np.repeat(felt.noise**2, 3))[few, few]
        return LinearisedObservation(seen[few] - H @ z.mean, np.zeros((len(H), 0)), H, R)

    def _into_flange(self, q: Array, wrench: Array) -> Array:
        """A wrench (6,) from the base's axes into the last joint's."""
        turn = self._root_to_base @ self.arm.pose(q, self.arm.link_names[-1])[:3, :3]
        return np.concatenate([turn.T @ wrench[:3], turn.T @ wrench[3:]])
