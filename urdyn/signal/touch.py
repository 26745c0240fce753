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
from urdyn.signal.channels import IN_CONTACT
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

    def felt(self, value: Any) -> Any:
        """Whether values of the channel say contact; a number, or (N,); NaN does not."""
        bit = value if self.bit is None else value // 2**self.bit % 2
        return (bit > 0) | (bit < 0)

    def require_lone(self, shape: tuple[int, ...], path: str) -> None:
        """LogError where a row of the channel is of that `shape`, and not one number."""
        if shape:
            raise LogError(
                f"{self.channel} has {shape[0]} numbers a row; contact is told by one", path
            )

    def marked(self, log: Log) -> Log:
        """The log with these rows in contact; LogError where it has no such channel."""
        if self.channel not in log:
            raise LogError(self.unknown, log.source.path)
        value = log.channels[self.channel]
        self.require_lone(value.shape[1:], log.source.path)
        told = np.asarray(self.felt(value), dtype=np.float64)
        return replace(log, channels={**log.channels, IN_CONTACT: told})


def touch_of(text: str) -> Touch:
    """The touch that CHANNEL or CHANNEL:BIT names."""
    match = FORM.fullmatch(text)
    if not match:
        told = "write CHANNEL, or CHANNEL:BIT, like actual_digital_output_bits:3"
        raise InputError(f"contact {text!r}: {told}")
    return Touch(match[1], int(match[2]) if match[2] else None)


def in_contact(log: Log, where: str) -> Log:
    """The log with the rows marked in which the arm works in contact.

    day = urdyn.in_contact(urdyn.read("day.parquet"), "actual_digital_output_bits:3")

    Their currents are not learnt from and not judged, by whatever takes the log.

    Args:
        where: CHANNEL or CHANNEL:BIT; not 0 in contact.

    Raises:
        InputError: `where` is no such name.
        LogError: the log has no such channel, or several numbers a row there.
    """
    return touch_of(where).marked(log)
