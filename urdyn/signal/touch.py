"""When an arm works in contact, as a channel of its stream says.

To the joints a force along the tool's path is as their friction, and one against gravity as a load.
Currents do not tell these apart: whoever programs the arm does.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdyn.errors import InputError, LogError
from urdyn.given import given_a
from urdyn.signal.channels import IN_CONTACT, ever_in_contact
from urdyn.types import Log

BITS = 53  # bits of a whole number that a channel holds exactly
FORM = re.compile(r"([^:\s]+)(?::(\d{1,2}))?")


@dataclass(frozen=True)
class Touch:
    """A channel, or a bit of it, that is not 0 while the arm works in contact."""

    channel: str  # one number a row
    bit: int | None = None  # from 0, the lowest; None: the whole value

    def __post_init__(self) -> None:
        if self.bit is not None and not 0 <= self.bit < BITS:
            raise InputError(f"contact {self}: bits are 0 to {BITS - 1}")

    def __str__(self) -> str:
        return self.channel if self.bit is None else f"{self.channel}:{self.bit}"

    @property
    def unknown(self) -> str:
        """What is said of a stream without the channel."""
        return f"has no channel {self.channel} to say when the arm is in contact"

    @property
    def unfelt(self) -> str:
        """What is said of a stream that is never in contact."""
        return f"never in contact by {self}: is it the right channel and bit?"

    def felt(self, value: Any) -> Any:
        """Whether values of the channel say contact; a number, or (N,); none that is not finite."""
        known = np.where(np.isfinite(value), value, 0.0)
        return (known if self.bit is None else known // 2**self.bit % 2) != 0.0

    def require_lone(self, shape: tuple[int, ...], path: str) -> None:
        """LogError where a row of the channel is of that `shape`, and not one number."""
        if shape:
            raise LogError(
                f"{self.channel} has {shape[0]} numbers a row; contact is told by one", path
            )

    def marked(self, log: Log) -> Log:
        """The log with these rows in contact, too; LogError where it has no such channel."""
        if self.channel not in log:
            raise LogError(self.unknown, log.source.path)
        value = log.channels[self.channel]
        self.require_lone(value.shape[1:], log.source.path)
        told = self.felt(value) | ever_in_contact(log)
        return replace(log, channels={**log.channels, IN_CONTACT: told.astype(np.float64)})


def touch_of(text: str) -> Touch:
    """The touch that CHANNEL or CHANNEL:BIT names."""
    match = FORM.fullmatch(given_a(text, str, "contact", "CHANNEL or CHANNEL:BIT"))
    if not match:
        told = "write CHANNEL, or CHANNEL:BIT, like actual_digital_output_bits:3"
        raise InputError(f"contact {text!r}: {told}")
    return Touch(match[1], int(match[2]) if match[2] else None)


def in_contact(log: Log, where: str) -> Log:
    """The log with the rows marked in which the arm works in contact.

    day = urdyn.in_contact(urdyn.read("day.parquet"), "actual_digital_output_bits:3")

    Their currents are not learnt from and not judged, by whatever takes the log. Rows that were
    marked stay so, whether by an earlier call or by a channel `contact_state` of the log's own.

    Args:
        where: CHANNEL or CHANNEL:BIT; in contact a finite number other than 0.

    Raises:
        InputError: `where` is no such name.
        LogError: the log has no such channel, or several numbers a row there.
    """
    return touch_of(where).marked(log)
