"""The suspects: every slow kind on every joint, and the directions of its changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urdyn.diagnose.kinds.rules import PAYLOAD_STATES, SlowKind, unit
from urdyn.diagnose.residual.space import Space
from urdyn.types import Array, Index

LEAST = 0.1  # [-] least share of its current that a drive takes, however healthy it becomes


@dataclass(frozen=True, eq=False)
class Suspect:
    """A kind on a joint."""

    kind: SlowKind
    joint: int | None  # None: the tool
    places: Index  # (r,) indices among the directions
    sd: Array  # (r,) of a change, in units of the states
    unit: float  # of the first state, per reported unit
    doubt: float = 0.0  # [-] sd of the commissioned value that a change is reported as a share of

    def part_of(self, other: Suspect) -> bool:
        """Whether the other changes all that this one does, and more."""
        return set(self.places.tolist()) < set(other.places.tolist())

    def grown(self, size: float) -> float:
        """A change, as reported, in its kind's direction; 0 where it goes the other way."""
        sign = -self.kind.sign if self.kind.of_sensor else self.kind.sign
        return max(sign * size, 0.0) if sign else abs(size)

    def read(self, size: float, sd: float) -> tuple[float, float]:
        """A change of the first state, and its sd, as reported.

        A bank is linear in current: a drive that takes x more for the same torque has 1 / (1 + x)
        of its health left, not 1 - x.
        """
        told = left(size / self.unit) - 1.0 if self.kind.of_health else self.slope(size) * size
        return told, abs(self.slope(size)) * sd

    def slope(self, size: float) -> float:
        """Derivative of the reported value by the first state, where that changed by `size`."""
        if self.kind.of_health:
            return left(size / self.unit) ** 2 / self.unit
        return (-1.0 if self.kind.of_sensor else 1.0) / self.unit


@dataclass(frozen=True, eq=False)
class Suspects:
    """All suspects, and the directions of their changes."""

    states: Index  # (p,) state of each direction
    each: tuple[Suspect, ...]

    @cached_property
    def by_kind(self) -> tuple[tuple[SlowKind, Index, Index, Array], ...]:
        """Each kind, which suspects are of it, (g,), their places and sd, (g, r) both."""
        which = dict[str, list[int]]()
        for k, suspect in enumerate(self.each):
            which.setdefault(suspect.kind.name, []).append(k)
        return tuple(
            (
                self.each[at[0]].kind,
                np.array(at),
                np.array([self.each[k].places for k in at]),
                np.array([self.each[k].sd for k in at]),
            )
            for at in which.values()
        )

    def directions(self, n: int) -> Array:
        """E, (n, p)."""
        E = np.zeros((n, len(self.states)))
        E[self.states, np.arange(len(self.states))] = 1.0
        return E

    def freed_by(self, k: int) -> Suspect:
        """What may have changed with a suspect: friction is sized whole, so more than its name."""
        suspect = self.each[k]
        whole = (s for s in self.each if s.kind.of_friction and suspect.part_of(s))
        return next(whole, suspect) if suspect.kind.of_friction else suspect


def left(z: float) -> float:
    """What is left of a drive's health by its state z, (0, 1] unless it gained [-]."""
    return 1.0 / max(1.0 - z, LEAST)


def suspects(space: Space, kinds: tuple[SlowKind, ...]) -> Suspects:
    """All kinds on all joints; the payload belongs to no joint."""
    each, states = [], list[int]()
    for kind in kinds:
        for j in [None] if kind.of_tool else range(space.joints):
            of = [_place(space, state, j) for state in kind.change]
            units = [_unit(space, state, j) for state in kind.change]
            states += [k for k in of if k not in states]
            suspect = Suspect(
                kind=kind,
                joint=j,
                places=np.array([states.index(k) for k in of]),
                sd=np.array(list(kind.change.values())) * units,
                unit=units[0],
                doubt=_doubt(space, kind, j),
            )
            each.append(suspect)
    return Suspects(np.array(states), tuple(each))


def _doubt(space: Space, kind: SlowKind, joint: int | None) -> float:
    """Relative sd of the commissioned friction that a change is stated as a share of; else 0.

    For kinds reported as all friction of a joint, `friction.rise` includes it instead.
    """
    share = {"f": "f", "alpha": "alpha", "o": "f"}.get(next(iter(kind.change)))
    of = None if kind.of_friction else share
    return float(np.sqrt(space.cov.diagonal()[_place(space, of, joint)])) if of else 0.0


def _place(space: Space, state: str, joint: int | None) -> int:
    if joint is None:
        return int(space.places["payload"].start) + PAYLOAD_STATES.index(state)
    return int(space.places[state].start) + joint


def _unit(space: Space, state: str, joint: int | None) -> float:
    each = unit(space, state)
    return 1.0 if joint is None else float(np.broadcast_to(each, space.joints)[joint])
