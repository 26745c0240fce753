"""One protocol for every detector, and the loop that runs its online step over a series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

from urdyn.errors import InputError
from urdyn.given import given_rows
from urdyn.types import Array, freeze

S = TypeVar("S")


@dataclass(frozen=True, eq=False)
class Verdict:
    """A detector's result after one step."""

    evidence: float  # [-] relative to the threshold, of all streams together: 1 or more is an alarm
    streams: Array  # (n,) [-] the same, of each stream
    kind: str = ""  # what explains the leading stream best: "ramp up", "step down", "variance", ...
    age: float = np.nan  # [steps] since its estimated onset

    def __post_init__(self) -> None:
        freeze(self, "streams")

    @property
    def alarm(self) -> bool:
        """Whether the evidence reaches the threshold."""
        return self.evidence >= 1.0

    @property
    def stream(self) -> int:
        """The stream with the most evidence."""
        return int(self.streams.argmax())


@runtime_checkable
class Detector(Protocol[S]):
    """Settings; all state is in the value S passed from step to step.

    S is made of arrays and numbers, so that a checkpoint can hold it.
    """

    def init(self, streams: int) -> S:
        """State of so many streams before the first step."""

    def step(self, state: S, observed: Array) -> tuple[S, Verdict]:
        """One step, by what was observed, (n,), NaN where nothing was.

        An alarm lasts until `acknowledged`; the promise is kept from there to the next.
        """

    def acknowledged(self, state: S) -> S:
        """State after an alarm: evidence starts anew, what is known of healthy streams is kept."""


@runtime_checkable
class SpreadJudge(Protocol[S]):
    """A detector that also looks for a growing spread, and needs to know how much was followed."""

    def step_beside(self, state: S, observed: Array, wider: Array) -> tuple[S, Verdict]:
        """One step, by innovations already divided by `wider`, (n,)."""


@runtime_checkable
class Taught(Protocol[S]):
    """A detector that can be shown what healthy innovations are like, beyond their spread."""

    def taught(self, healthy: Array) -> Detector[S]:
        """The same, with such innovations, (N, n) [sd], taken for healthy; NaN: not measured."""


@runtime_checkable
class Alone(Protocol):
    """A detector of raw streams: no baseline is put before it."""

    @property
    def alone(self) -> str:
        """Why, in a sentence."""


@dataclass(frozen=True, eq=False)
class Detection:
    """A detector's results over a series."""

    alarms: tuple[int, ...]  # rows of the series with an alarm, each acknowledged at once
    verdicts: tuple[Verdict, ...]  # N

    def __post_init__(self) -> None:
        assert all(self.verdicts[row].alarm for row in self.alarms)

    @property
    def detected(self) -> bool:
        """At least one alarm."""
        return bool(self.alarms)

    @property
    def alarm(self) -> int | None:
        """Row of the first alarm, None where there is none."""
        return self.alarms[0] if self.alarms else None

    @property
    def stream(self) -> int | None:
        """The leading stream at the first alarm."""
        return self.verdicts[self.alarms[0]].stream if self.alarms else None

    @property
    def onset(self) -> int | None:
        """Row at which the change began, as estimated at the first alarm.

        None where there is no alarm, and where a step or a variance leads: sums over all onsets
        keep the age of ramps alone. `GLR` gives that of a step, too.
        """
        if not self.alarms:
            return None
        age = self.verdicts[self.alarms[0]].age
        return max(0, round(self.alarms[0] + 1 - age)) if np.isfinite(age) else None

    @property
    def evidence(self) -> Array:
        """History of the evidence relative to the threshold, (N,)."""
        return np.array([verdict.evidence for verdict in self.verdicts])


def given_detector(detector: object) -> None:
    """InputError unless this is a detector: an object with its three methods, not its class."""
    if isinstance(detector, type) or not isinstance(detector, Detector):
        raise InputError(
            f"detector {detector!r}: takes one with its settings, ShiryaevRoberts() say"
        )


def run(detector: Detector[S], observed: Array) -> Detection:
    """Run `detector` over a series (N, n), one `step` per row, each alarm acknowledged at once."""
    rows = given_rows(observed, "a series")
    given_detector(detector)
    state = detector.init(rows.shape[1])
    alarms, verdicts = [], []
    for row, values in enumerate(rows):
        state, verdict = detector.step(state, values)
        verdicts.append(verdict)
        if verdict.alarm:
            alarms.append(row)
            state = detector.acknowledged(state)
    return Detection(tuple(alarms), tuple(verdicts))
