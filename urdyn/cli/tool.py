"""The tool that an arm bears from commissioning on, by its mass and centre of mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from urdyn.errors import InputError

if TYPE_CHECKING:
    import urdyn as ud
    from urdyn.types import Array

ALIKE = 0.01  # [kg] precision of a controller's setting


@dataclass(frozen=True)
class Tool:
    """A known tool; mass 0 means none."""

    mass: float  # [kg]
    com: tuple[float, ...]  # (3,) [m] at the flange; NaN: not given

    def inertials(self) -> Array:
        """(10,) in the last joint's frame, as of a solid ball."""
        import numpy as np

        from urdyn.simulate import Payload

        return Payload(self.mass, np.array(self.com)).inertials() if self.mass else np.zeros(10)

    def __str__(self) -> str:
        centre = zip("XYZ", self.com, strict=True)
        return ",".join([f"{self.mass:.4g}", *(f"{x:.4g}" if x == x else at for at, x in centre)])


def tool_of(numbers: Sequence[float]) -> Tool:
    """The tool from its mass [kg] and X,Y,Z [m] of its centre; a mass of 0 needs no centre."""
    mass, *com = numbers
    if len(com) != 3 and (com or mass):
        raise InputError(
            f"tool {','.join(f'{x:g}' for x in numbers)}: MASS,X,Y,Z in kg and m, like "
            "1.2,0,0,0.06, or 0; leave out a tool whose centre nobody knows: it is then found "
            "within the last link"
        )
    tool = Tool(mass, tuple(com) or (0.0, 0.0, 0.0))
    tool.inertials()  # InputError if the tool is impossible
    return tool


def remark(tool: Tool | None, setting: Tool | None) -> str:
    """A remark on the tool beside the controller's setting during the recording; or nothing."""
    if setting is None:
        return ""
    said = f"the controller was set to {setting.mass:.2f} kg while this was recorded"
    if tool is None and setting.mass:
        return (
            f"{said}, which was not used: if the arm bore that, --tool {setting} tells it apart "
            "from the last link; if it bore nothing, --tool 0"
        )
    if tool is not None and abs(tool.mass - setting.mass) > ALIKE:
        return f"{said}, and not to the {tool.mass:.2f} kg of its tool"
    return ""


def setting_of(log: ud.Log) -> Tool | None:
    """The controller's last payload setting in a log; None: not in it."""
    from urdyn.signal import samples

    mass, *com = next(samples(log.slice(len(log) - 1))).setting.tolist()
    return Tool(mass, tuple(com)) if mass == mass else None
