"""What is shown, moment by moment: a recording of it, or one moment of a robot at work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from urdyn.types import Array, freeze


@dataclass(frozen=True, eq=False)
class Moment:
    """One moment; NaN where unknown."""

    t: float  # [s] since the beginning
    q: Array  # (J,) [rad] by the encoders
    zero: Array  # (J,) [rad] by which the joints are off that
    friction: Array  # (J,) [%] change of friction since commissioning
    health: Array  # (J,) [%] change of drive health
    torque: Array  # (J,) [N·m] measured less predicted


@dataclass(frozen=True, eq=False)
class Film:
    """Moments in a row."""

    t: Array  # (N,) [s], not falling
    q: Array  # (N, J)
    zero: Array  # (N, J)
    friction: Array  # (N, J)
    health: Array  # (N, J)
    torque: Array  # (N, J)

    def __post_init__(self) -> None:
        freeze(self)
        for name in self.__match_args__[1:]:
            assert getattr(self, name).shape == self.q.shape, name

    def __len__(self) -> int:
        return len(self.t)

    @property
    def end(self) -> float:
        """Time of the last moment [s]."""
        return float(self.t[-1])

    def at(self, t: float) -> Moment:
        """The last moment that is not after `t` [s]."""
        return self.moment(max(0, int(np.searchsorted(self.t, t, side="right")) - 1))

    def moment(self, row: int) -> Moment:
        """One row."""
        rest = (getattr(self, field.name)[row] for field in fields(self)[1:])
        return Moment(float(self.t[row]), *rest)

    def slice(self, start: int, stop: int, step: int = 1) -> Film:
        """Rows as a film of its own."""
        return Film(*(getattr(self, field.name)[start:stop:step] for field in fields(self)))


def film(moments: Sequence[Moment]) -> Film:
    """Moments joined."""
    return Film(*(np.array([getattr(m, f.name) for m in moments]) for f in fields(Film)))
