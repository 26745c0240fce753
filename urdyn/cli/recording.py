"""A requested recording: a file, which part of it, and how it is read."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import urdyn as ud
from urdyn.cli.voice import complaints
from urdyn.errors import InputError
from urdyn.io.effort import UNTOLD, Effort
from urdyn.signal.channels import IN_CONTACT, STATUS, ever_in_contact
from urdyn.signal.touch import Touch, touch_of

# All that dynamics needs from a log; an hour of all channels would fill the memory.
CHANNELS = (
    *("actual_q", "actual_qd", "actual_current", "target_current", "joint_temperatures"),
    *("payload", "payload_cog", "target_moment", "actual_TCP_pose", *STATUS, IN_CONTACT),
)

Rows = tuple[int | None, int | None]


@dataclass(frozen=True)
class Recording:
    """A log, or a part of one."""

    path: Path
    columns: str | None = None  # of a file without a header
    rows: Rows | None = None  # half-open slice of its data rows
    rate: float | None = None  # [Hz] of a file without time stamps
    mass: float | None = None  # [kg] of the payload in it, where it is known
    effort: Effort = UNTOLD  # unit of a bag's efforts
    contact: Touch | None = None  # what tells that the arm works in contact

    def __post_init__(self) -> None:
        if self.mass is not None and not 0.0 < self.mass < math.inf:
            raise InputError(f"a payload of {self.mass:g} kg cannot be; give its mass in kg")

    def read(self) -> ud.Log:
        """The log."""
        log = ud.read(
            self.path,
            columns=self.columns,
            rows=self.rows,
            rate=self.rate,
            channels=(*CHANNELS, *([self.contact.channel] if self.contact else [])),
            effort=self.effort,
        )
        return self.contact.marked(log) if self.contact else log

    def complaints(self, log: ud.Log) -> list[str]:
        """What to say of its log, in a line each: defects, and that no row is in contact."""
        touch = self.contact
        unfelt = [touch.unfelt] if touch and not ever_in_contact(log).any() else []
        return complaints(log.source.path, (*log.defects, *unfelt))


def contact_named(text: str | None) -> Touch | None:
    """What CHANNEL or CHANNEL:BIT names."""
    return None if text is None else touch_of(text)


def slice_of(text: str) -> Rows:
    """First and stop of "635:3510", "635:" or ":3510"."""
    match = re.fullmatch(r"([0-9]{0,15}):([0-9]{0,15})", text)
    if not match:
        raise InputError(f"rows {text!r} are no slice; write first:stop, from 0, like 635:3510")
    first, stop = (int(digits) if digits else None for digits in match.groups())
    if stop is not None and stop <= (first or 0):
        raise InputError(f"rows {text!r} are empty; write first:stop with first below stop")
    return first, stop


def numbers_of(text: str, what: str) -> tuple[float, ...]:
    """The finite numbers of "0.1,0.2,0.3"."""
    try:
        numbers = tuple(float(cell) for cell in text.split(","))
    except ValueError:
        raise InputError(f"{what} {text!r}: write numbers with commas between them") from None
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{what} {text!r}: every number must be finite")
    return numbers
