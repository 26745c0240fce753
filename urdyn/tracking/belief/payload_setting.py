"""The controller's payload setting, compared with the tracked load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from urdyn.io.plain import plain
from urdyn.model.body import centre_of_mass
from urdyn.signal import UNSET
from urdyn.tracking.belief.payload_holds import Hold, Holds, tolerance
from urdyn.tracking.belief.physical import KNOWN
from urdyn.types import Array

# [s] of motion for which a setting must have stood before it is called wrong: a program sets it
# just before or after its gripper closes, and the piece must be weighed first.
STOOD = 5.0


@dataclass(frozen=True, eq=False)
class Setting:
    """The payload that the controller reports to be set to."""

    # (4,) mass [kg] and its centre in the flange's axes [m]; NaN: not reported
    payload: Array = field(default_factory=lambda: UNSET)
    stood: float = 0.0  # [s] of motion since that mass was set
    hold: Hold = field(default_factory=Hold)  # that lasts
    holds: Holds = field(default_factory=Holds)  # before it
    tool: float = 0.0  # [kg] that every hold includes; 0: not named

    @property
    def mass(self) -> float:
        """Mass that is set [kg]; NaN: not reported."""
        return float(self.payload[0])

    def heard(self, told: Array, moved: float) -> Setting:
        """Updated by a sample's setting, (4,), after `moved` seconds of motion."""
        mass = float(told[0])
        if mass != mass:
            return self
        if mass != self.mass:
            return replace(self.released(), payload=told, stood=0.0)
        hold = replace(self.hold, lasted=self.hold.lasted + moved)
        return replace(self, payload=told, stood=self.stood + moved, hold=hold)

    def beside(self, mass: float, sd: float, known: bool, another: bool) -> Setting:
        """Updated by what is carried, mass and sd [kg].

        Args:
            known: the motion has told it, also since the arm last set off: until another load is
                found, one that the arm has just picked up may be known already.
            another: another load was found.
        """
        if another:
            return self.released()
        return replace(self, hold=self.hold.seen(mass, sd)) if known else self

    def released(self) -> Setting:
        """With a hold ended."""
        if np.isinf(self.hold.sd) or self.mass != self.mass:
            return replace(self, hold=Hold())
        return replace(self, hold=Hold(), holds=self.holds.after(self.hold, self.mass, self.tool))


def settable(load: Array) -> tuple[float, Array]:
    """Mass [kg] and its centre (3,) [m] of a load, (4,), as a controller accepts them.

    The mass is at least 0; without a noticeable mass, its centre is the flange.
    """
    return max(float(load[0]), 0.0), np.nan_to_num(centre_of_mass(load))


def agrees(setting: Setting, final: Mapping[str, Any]) -> bool:
    """Whether the controller is set to the tracked load, within its uncertainty.

    A tool that was not named counts as none: nothing else tells its mass.

    Args:
        final: quantities as in a summary.
    """
    load = final["payload.mass"]
    sd = min(load["sd"], KNOWN)  # while anything may be carried, any setting would do
    return bool(abs(load["mean"] - setting.mass) <= tolerance(sd))


def compared(
    setting: Setting, mass: float, sd: float, whole: bool, known: bool
) -> dict[str, Any] | None:
    """The setting beside the tracked mass, in plain numbers; None: no setting was reported.

    `off_kg` is how much more is carried than the controller assumes, None where it may be 0. Where
    the twin's last link contains a tool that was not named, the controller's payload includes it
    and the tracked mass does not: only too small a setting shows, and `off_kg` is a lower bound.
    `holds` compares all holds so far, this one included.

    Args:
        mass: the tracked mass [kg].
        sd: its standard deviation [kg].
        whole: it includes the tool, as the controller's does.
        known: the motion has told it; without that nothing is off.
    """
    if setting.mass != setting.mass:
        return None
    off = mass - setting.mass
    sure = known and setting.stood >= STOOD and abs(off) > tolerance(sd) and (whole or off > 0.0)
    return {
        "mass_kg": setting.mass,
        "com_m": [plain(x) for x in setting.payload[1:]],
        "tool_known": whole,
        "off_kg": plain(off) if sure else None,
        "holds": setting.released().holds.plain(whole),
    }


def at_the_end(
    setting: Setting, final: Mapping[str, Any], whole: bool, known: bool
) -> dict[str, Any] | None:
    """The same at a run's end, from the quantities of its summary."""
    load = final["payload.mass"]
    return compared(setting, load["mean"], load["sd"], whole, known)
