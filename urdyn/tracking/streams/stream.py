"""Streams beside the joints' own sensors, each at a rate of its own and used when it arrives.

A row waits until the motion has been estimated up to its stamp, which takes half a window of
samples. A row with NaN, or a missing one, leaves everything else as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from urdyn.dbn.joined import Joined
from urdyn.dbn.measurement import LinearMeasurement, Standing
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.estimate import Filter
from urdyn.estimate.protocol import S
from urdyn.signal import Instant
from urdyn.tracking.belief.beliefs import marginal
from urdyn.tracking.streams.conditional_filter import SharedMeasurement
from urdyn.types import Array, Gaussian, Index

MOST = 500  # rows that may wait: with more, no motion is coming
NEAR = 1.5  # periods from an instant, within which its motion gives the angles at a stamp

NO_STATES = RandomWalk((), Gaussian(np.zeros(0), np.zeros((0, 0))), np.zeros(0))

A = TypeVar("A")


@dataclass(frozen=True, eq=False)
class Heard(Generic[A]):
    """The state of a stream."""

    waiting: Array  # (n, width) rows that the motion has not reached
    state: A

    def with_more(self, rows: Array | None) -> Heard[A]:
        """With a sample's rows added."""
        if rows is None or not len(rows):
            return self
        return replace(self, waiting=np.concatenate([self.waiting, rows])[-MOST:])


class Stream(Protocol[A]):
    """Turns rows into measurements of the arm; its state is a value that is passed along."""

    @property
    def name(self) -> str:
        """Which of a sample's streams it is."""

    @property
    def width(self) -> int:
        """Width of a row: its stamp [s], six numbers, and what follows them."""

    @property
    def shared(self) -> str:
        """Group of the currents' states that it measures too; "": none."""

    @property
    def own(self) -> RandomWalk:
        """Further states that the currents' filter is to have for it."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities that it alone estimates."""

    @property
    def units(self) -> tuple[str, ...]:
        """One unit per name."""

    def init(self) -> A:
        """The state before any row."""

    def take(
        self, state: A, now: Instant, row: Array, z: Gaussian
    ) -> tuple[A, SharedMeasurement | None]:
        """Take one row, with the motion at its stamp and the belief z in shared and own states.

        Returns:
            The state, and the row as a measurement for the currents' filter; None where it is none.
        """

    def settled(self, state: A, z: Gaussian) -> A:
        """The state after the currents' filter was updated by that measurement."""

    def touching(self, state: A, t: float) -> bool:
        """Whether rows show that the arm is in contact at t [s], whatever it carries."""

    def estimates(self, state: A) -> tuple[Array, Array]:
        """Means and standard deviations of the quantities; NaN while there are none."""


@dataclass(frozen=True, eq=False)
class Moment:
    """An instant, as the streams see it."""

    now: Instant  # stamped at the time of its angles
    period: float  # [s]
    at: Index  # (z,) shared states, and the stream's own


def first(stream: Stream[A]) -> Heard[A]:
    """The stream before its first row."""
    return Heard(np.zeros((0, stream.width)), stream.init())


def assimilated(
    stream: Stream[A],
    heard: Heard[A],
    at: Moment,
    filter_: Filter[S],
    model: Joined[RobotSlice],
    belief: S,
) -> tuple[S, Heard[A]]:
    """The currents' belief and the stream's, after all rows up to half a period past the moment."""
    stamps = heard.waiting[:, 0]
    due = stamps <= at.now.t + 0.5 * at.period
    if not due.any():
        return belief, heard
    state = heard.state
    for row in heard.waiting[due]:
        if abs(row[0] - at.now.t) > NEAR * at.period:
            continue
        z = marginal(filter_, belief, at.at)
        state, shared = stream.take(state, _at(at.now, float(row[0])), row, z)
        if shared is not None:
            standing: Any = Standing(model.names, model.prior)
            belief, _ = filter_.step(
                standing,
                belief,
                LinearMeasurement(at.at, shared.H, shared.R, shared.jump),
                shared.y,
            )
            state = stream.settled(state, marginal(filter_, belief, at.at))
    return belief, replace(heard, waiting=heard.waiting[~due], state=state)


def _at(now: Instant, t: float) -> Instant:
    """The motion extrapolated to t, just before or after the instant."""
    dt = t - now.t
    q = now.q + dt * (now.v + 0.5 * dt * now.a)
    return replace(now, t=t, q=q, v=now.v + dt * now.a)
