"""Effort -> motor current: a bag does not say whether a joint's effort is A or N·m, a user does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from urdyn.errors import InputError, LogError
from urdyn.types import Array, freeze

EFFORT = "effort"  # channel of a table whose unit is not known yet
UNITS = ("A", "Nm")


@dataclass(frozen=True, eq=False)
class Effort:
    """The unit of a recording's efforts, and the drive gains behind it.

    Torques [N·m] that a driver or a recorder computed from current are current times a drive gain
    [N·m/A]; divided by the gains in use they are current again, i = tau / K. Those gains are then
    exact by definition: whatever the true ones are, the torque is the published one.
    """

    unit: str | None = None  # "A" or "Nm"; None: not given
    gain: ArrayLike | None = None  # (J,) [N·m/A], where the unit is Nm

    def __post_init__(self) -> None:
        if self.unit not in (None, *UNITS):
            raise InputError(f"effort unit {self.unit!r}: is to be A or Nm")
        if self.unit == "Nm" and self.gain is None:
            raise InputError("efforts in Nm become currents by drive gains; give them, N·m/A each")
        if self.gain is not None:
            freeze(self, "gain")

    def current(self, effort: Array) -> Array:
        """Motor current (J,) [A] of efforts in the given unit."""
        return np.asarray(effort / np.asarray(self.gain)) if self.unit == "Nm" else effort

    def told(self, path: str) -> None:
        """LogError where the unit of effort was not given."""
        if self.unit is None:
            raise LogError(
                "does not say what its efforts are: give --effort-unit A (motor current, as "
                "UR's driver publishes it) or --effort-unit Nm (joint torque); in Python "
                'effort=Effort("A") or Effort("Nm", gain)',
                path,
            )

    def amperes(self, channels: dict[str, Array], path: str) -> dict[str, Array]:
        """Channels with `actual_current` [A]; LogError where the unit of effort was not given."""
        told = dict(channels)
        if EFFORT in told:
            self.told(path)
            told["actual_current"] = told.pop(EFFORT)
        if self.unit == "Nm" and "actual_current" in told:
            told["actual_current"] = self._divided(told["actual_current"], path)
        return told

    def _divided(self, torque: Array, path: str) -> Array:
        gain = np.asarray(self.gain)
        if gain.shape != torque.shape[1:] or not (np.isfinite(gain).all() and (gain > 0.0).all()):
            joints = torque.shape[1] if torque.ndim > 1 else 1
            raise LogError(f"has {joints} joints; give as many drive gains above 0, N·m/A", path)
        return np.asarray(torque / gain)


UNTOLD = Effort()  # not given: recordings that need it are refused, not guessed
