"""The campaign that `identify` is to carry out: from options, or a file that they override."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any, TypeVar

import typer

from urdyn.cli.campaign import Campaign, read_campaign
from urdyn.cli.recording import Recording, contact_named, numbers_of, slice_of
from urdyn.cli.tool import Tool, tool_of

T = TypeVar("T", Campaign, Recording)


def typed() -> str:
    """The command line as it was typed, which reproduces its results."""
    return shlex.join(["urdyn", *sys.argv[1:]])


def asked(logs: Sequence[Path], robot: str | None, out: Path | None) -> Campaign:
    """The campaign in a file, or one of logs."""
    campaigns = [path for path in logs if path.suffix.lower() == ".toml"]
    if campaigns and len(logs) > 1:
        raise typer.BadParameter(f"{campaigns[0]}: a campaign stands alone, it names its logs")
    if campaigns:
        return overridden(read_campaign(campaigns[0]), robot=robot, out=out)
    if robot is None or out is None:
        option, what = ("--robot", "the arm") if robot is None else ("--out", "a folder")
        told = f"missing: name {what}, or a campaign that says it"
        raise typer.BadParameter(told, param_hint=option)
    return Campaign(robot, tuple(map(Recording, logs)), out=out)


def overridden(value: T, **options: Any) -> T:
    """`value` with those of the options that are given; None: not given."""
    return replace(value, **{k: option for k, option in options.items() if option is not None})


def loaded(
    campaign: Campaign, logs: Sequence[Path] | None, masses: Sequence[float] | None
) -> tuple[Recording, ...]:
    """Recordings with a payload: these logs, else the campaign's, with the masses in order."""
    recordings = tuple(map(Recording, logs)) if logs else campaign.payloads
    masses = masses or ()
    if len(masses) > len(recordings):
        raise typer.BadParameter(
            f"{len(masses)} x --payload-mass for {len(recordings)} x --payload-log"
        )
    return tuple(overridden(one, mass=mass) for one, mass in zip_longest(recordings, masses))


def read_as(
    recordings: tuple[Recording, ...],
    columns: str | None,
    rows: str | None,
    rate: float | None,
    contact: str | None,
) -> tuple[Recording, ...]:
    """The recordings read in another way where options say so."""
    if rows is not None and len(recordings) != 1:
        raise typer.BadParameter(f"rows {rows} of which log? these options describe one log only")
    part = slice_of(rows) if rows is not None else None
    options = {"columns": columns, "rows": part, "rate": rate, "contact": contact_named(contact)}
    return tuple(overridden(one, **options) for one in recordings)


def gains_of(text: str | None) -> tuple[float, ...] | None:
    """Drive gains [N·m/A] of an option."""
    return None if text is None else numbers_of(text, "drive gains")


def tool_named(text: str | None) -> Tool | None:
    """The tool of an option: its mass, and X,Y,Z of its centre."""
    return None if text is None else tool_of(numbers_of(text, "tool"))
