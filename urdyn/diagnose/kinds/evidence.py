"""Evidence that is acted upon, by type; its keys are those of findings.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from urdyn.types import Array

CLIPPED = "clipped"  # the mode of a sensor that is stuck at its limit, and right below it
ENCODER = "encoder"  # the mode of an encoder's fault
SILENT = ("dropped", ENCODER)  # modes of a sensor without readings


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence of an event or of its finding."""

    said: Mapping[str, Any]

    @property
    def mode(self) -> str | None:
        """How a sensor fails at once; None: no such fault."""
        return self.said.get("mode")

    @property
    def slow(self) -> bool:
        """Whether it is of a slow kind, which has rivals, not of a test of its own."""
        return "rivals" in self.said

    @property
    def of_encoder(self) -> bool:
        """Whether the sensor in question is the encoder, not that of the current."""
        return self.mode in (None, ENCODER)

    @property
    def silent(self) -> bool:
        """Whether a sensor gives, or gave, no readings."""
        return self.mode in SILENT

    @property
    def to_and_fro(self) -> bool:
        """Whether a zero jumps back and forth: an angle that is noisy, or loose."""
        return bool(self.said.get("to_and_fro"))

    @property
    def until(self) -> float | None:
        """When it was over [s]; None: it is not."""
        return self.said.get("until_s")

    @property
    def anew(self) -> float | None:
        """When it last began again [s]; None: not given."""
        return self.said.get("anew_s")

    @property
    def times(self) -> int:
        """How often it was there."""
        return int(self.said.get("times", 1))

    @property
    def at_once(self) -> int:
        """Fewest joints whose sensors fell silent at the same row, this one included."""
        return int(self.said.get("at_once", 1))

    @property
    def ever_heard(self) -> bool:
        """Whether a silent sensor has given any reading since the run began."""
        return bool(self.said.get("ever_heard", True))

    @property
    def growing(self) -> bool:
        """Whether a swing surely grows."""
        return bool(self.said.get("growing"))

    @property
    def fading(self) -> bool:
        """Whether a swing surely fades."""
        return bool(self.said.get("fading"))

    @property
    def recurs_at(self) -> str | None:
        """Reversals of what, at which a jolt of play recurs; None: the gap itself was seen."""
        return self.said.get("recurs_at")

    @property
    def torque(self) -> Array:
        """Torques of a push at its peak, (J,) [N·m]."""
        return np.asarray(self.said["torque_Nm"])

    @property
    def alone(self) -> int | None:
        """The only joint that felt a push; None: several did."""
        return self.said.get("alone")
