"""What the controller takes for the payload, beside the load that is tracked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from urdyn.io.plain import plain
from urdyn.model.body import centre_of_mass
from urdyn.signal import UNSET
from urdyn.types import Array

# [s] of motion that a setting has to have stood for before it is called wrong: a program sets it
# a moment before or after its gripper closes, and what that took up is to be weighed first.
STOOD = 5.0
# [sd] beyond the interval that is told: who tracks all day is not to be told in 1 of 10 looks.
SURE = 3.0
LEAST = 0.1  # [kg] that matters to a controller


@dataclass(frozen=True, eq=False)
class Setting:
    """The payload that the controller is set to, as it says."""

    # (4,) mass [kg] and its centre at the flange [m]; NaN: it does not say
    payload: Array = field(default_factory=lambda: UNSET)
    stood: float = 0.0  # [s] of motion since that mass was set

    @property
    def mass(self) -> float:
        """[kg]; NaN: the controller does not say."""
        return float(self.payload[0])

    def heard(self, told: Array, moved: float) -> Setting:
        """With what a sample tells, (4,), after `moved` seconds of motion."""
        mass = float(told[0])
        if mass != mass:
            return self
        return Setting(told, self.stood + moved if mass == self.mass else 0.0)


def settable(load: Array) -> tuple[float, Array]:
    """Mass [kg] and its centre at the flange (3,) [m] of a load, (4,), as a controller takes them.

    No mass is below 0, and the centre of what has none to speak of is the flange.
    """
    return max(float(load[0]), 0.0), np.nan_to_num(centre_of_mass(load))


def tolerance(sd: float) -> float:
    """By how much a setting may be off a mass that is known to this sd, both in kg."""
    return max(SURE * sd, LEAST)


def agrees(setting: Setting, final: Mapping[str, Any], whole: bool) -> bool:
    """Whether the controller is set to the load that is tracked, within what is known of it.

    Args:
        final: quantities as a summary has them.
        whole: the mass counts the tool, as the controller does.
    """
    if not whole or setting.mass != setting.mass:
        return False
    load = final["payload.mass"]
    return bool(abs(load["mean"] - setting.mass) <= tolerance(load["sd"]))


def compared(setting: Setting, mass: float, sd: float, whole: bool) -> dict[str, Any] | None:
    """The setting beside the mass that is tracked, in plain numbers; None: nobody said any.

    `off_kg` is by how much more is carried than the controller takes for it, None where that may
    be nothing. Where the twin's last link has a tool in it that nobody named, the controller's
    payload counts what is not in the mass that is tracked: only too little shows, and only the
    least of it.

    Args:
        mass: what is tracked [kg].
        sd: its standard deviation [kg].
        whole: it counts the tool, as the controller does.
    """
    if setting.mass != setting.mass:
        return None
    off = mass - setting.mass
    sure = setting.stood >= STOOD and abs(off) > tolerance(sd) and (whole or off > 0.0)
    return {
        "mass_kg": setting.mass,
        "com_m": [plain(x) for x in setting.payload[1:]],
        "tool_known": whole,
        "off_kg": plain(off) if sure else None,
    }


def at_the_end(setting: Setting, final: Mapping[str, Any], whole: bool) -> dict[str, Any] | None:
    """The same when a run is over, by the quantities of its summary."""
    load = final["payload.mass"]
    return compared(setting, load["mean"], load["sd"], whole)
