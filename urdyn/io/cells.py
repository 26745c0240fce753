"""The cells of a line of text, and what number is in one, if there is one."""

from __future__ import annotations

import csv
import math
from contextlib import suppress
from datetime import UTC, datetime

FLAGS = {"true": 1.0, "false": 0.0}
# Said of no value.
NOTHING = ("None", "none", "NONE", "Null", "NULL", "null", "N/A", "n/a", "NA", "-", "--")


def fields(line: str, delimiter: str) -> list[str]:
    """Cells of a line; quotes are taken off, a run of spaces is one."""
    if '"' in line:
        with suppress(csv.Error):  # a quote that is damage: the line is split as it stands
            return next(csv.reader([line.replace("\0", "")], delimiter=delimiter), [])
    return line.split() if delimiter == " " else line.split(delimiter)


def is_empty(text: str) -> bool:
    """Does the cell hold nothing, or say that it does?"""
    text = text.strip()
    return not text or text in NOTHING


def number(text: str) -> float:
    """The number in a cell, True and False as 1 and 0; ValueError where there is none."""
    text = text.strip()
    if (flag := FLAGS.get(text.lower())) is not None:
        return flag
    if "_" in text:  # Python reads 1_0 as ten, a robot never writes it
        raise ValueError(text)
    return float(text)


def stamp(text: str) -> float:
    """Seconds in a cell: a number, or an ISO 8601 instant as seconds since 1970, UTC by default."""
    try:
        return number(text)
    except ValueError:
        instant = datetime.fromisoformat(text.strip())
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).timestamp()


def is_number(text: str) -> bool:
    """Does the cell hold a number or a flag?"""
    try:
        number(text)
    except ValueError:
        return False
    return True


def is_stamp(text: str) -> bool:
    """Does the cell hold a number or an instant?"""
    try:
        return not math.isnan(stamp(text))
    except (ValueError, OverflowError):
        return False
