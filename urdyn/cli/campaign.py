"""What to identify, from which recordings: given on the command line or in a campaign.toml.

    robot = "ur10e"                 # an arm of the library, or a URDF beside this file
    out = "out"                     # folder of the results
    columns = "timestamp,..."       # of all recordings that do not name their own
    drive_gain = [...]              # [N·m/A], where they are known
    tool = {mass = 1.2, com = [...]} # [kg, m at the flange] that all of them bore; mass 0: none
    effort_unit = "A"               # of efforts and currents; "Nm": torques, divided by the gains
    contact = "..."                 # CHANNEL[:BIT], not 0 in contact, of all that name no other
    [[log]]                         # path, columns, rows, rate, contact
    [[payload]]                     # the same, and its mass [kg] where that is known
    [[validate]]                    # recordings that the result is scored on
    [simulate]                      # instead of recordings: duration, rate, seed, payload_mass,
                                    # trajectory: a file that `urdyn excite` wrote

Paths start at the campaign's folder; ${NAME} in them is an environment variable.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from urdyn.cli.recording import Recording, contact_named, slice_of
from urdyn.cli.tool import Tool, tool_of
from urdyn.cli.virtual import Simulation
from urdyn.errors import CampaignError, InputError

NUMBER = (int, float)
RECORDING = {"path": str, "columns": str, "rows": str, "rate": NUMBER, "contact": str}
SIMULATE = {
    "duration": NUMBER,
    "rate": NUMBER,
    "seed": int,
    "payload_mass": NUMBER,
    "trajectory": str,
}
TOOL = {"mass": NUMBER, "com": list}
CAMPAIGN = {
    "robot": str,
    "out": str,
    "columns": str,
    "contact": str,
    "drive_gain": list,
    "tool": dict,
    "effort_unit": str,
    "log": list,
    "payload": list,
    "validate": list,
    "simulate": dict,
}
OTHERS = {"parameter": "a twin", "motion": "a plan of `urdyn excite`"}  # by a key of theirs
WORDS = {str: "text", int: "a whole number", NUMBER: "a number", list: "a list", dict: "a table"}


@dataclass(frozen=True)
class Campaign:
    """An identification to carry out."""

    robot: str
    logs: tuple[Recording, ...] = ()  # of the bare arm
    payloads: tuple[Recording, ...] = ()
    validate: tuple[Recording, ...] = ()  # that the result is scored on
    drive_gain: tuple[float, ...] | None = None  # (J,) [N·m/A]
    tool: Tool | None = None  # that the arm bore in all of them; None: not given
    effort_unit: str | None = None  # "A" or "Nm"; None: not given
    out: Path = Path("out")
    simulate: Simulation | None = None  # instead of recordings

    def __post_init__(self) -> None:
        if self.effort_unit not in (None, "A", "Nm"):
            raise InputError(f"effort unit {self.effort_unit!r}: is to be A or Nm")


def read_campaign(path: Path) -> Campaign:
    """The campaign in a file; CampaignError with the key that is to blame."""
    from urdyn.io import load_toml

    document = load_toml(path, CampaignError)
    for table, what in OTHERS.items():
        if table in document:
            told = f"{path}: is {what}, not a campaign; name recordings, or a campaign.toml"
            raise CampaignError(told)
    try:
        return _campaign(document, path.parent)
    except InputError as error:
        raise CampaignError(f"{path}: {error}") from error


def _campaign(document: dict[str, Any], folder: Path) -> Campaign:
    _check(document, CAMPAIGN, "")
    if "robot" not in document:
        raise CampaignError('no robot; write for example robot = "ur10e"')
    if bool(document.get("log")) == ("simulate" in document):
        raise CampaignError("name recordings with [[log]] or a virtual arm with [simulate]")
    if "simulate" in document and "payload" in document:
        raise CampaignError("[[payload]]: a virtual arm is loaded by payload_mass of [simulate]")
    beside = folder / document["robot"]
    return Campaign(
        robot=str(beside) if beside.is_file() else document["robot"],
        drive_gain=_gains(document.get("drive_gain")),
        tool=_tool(document.get("tool")),
        logs=_recordings(document, "log", folder),
        payloads=_recordings(document, "payload", folder),
        validate=_recordings(document, "validate", folder),
        effort_unit=document.get("effort_unit"),
        out=folder / document.get("out", "out"),
        simulate=_simulation(document.get("simulate"), folder),
    )


def _recordings(document: dict[str, Any], key: str, folder: Path) -> tuple[Recording, ...]:
    """The recordings under one key."""
    schema = RECORDING | ({"mass": NUMBER} if key == "payload" else {})
    found = []
    for count, table in enumerate(document.get(key, ()), start=1):
        where = f"[[{key}]] {count}: "
        if not isinstance(table, dict):
            raise CampaignError(f"{where}is to be a table")
        _check(table, schema, where)
        if "path" not in table:
            raise CampaignError(f"{where}no path")
        columns = table.get("columns", document.get("columns"))
        rows = slice_of(table["rows"]) if "rows" in table else None
        contact = table.get("contact", document.get("contact"))
        one = Recording(
            path=_file(table["path"], folder),
            columns=columns,
            rows=rows,
            rate=table.get("rate"),
            mass=table.get("mass"),
            contact=contact_named(contact),
        )
        found.append(one)
    return tuple(found)


def _file(name: str, folder: Path) -> Path:
    """Where a log is, by a name that may hold environment variables; it must be there."""
    from urdyn.io import is_log

    variables = re.findall(r"\$\{(\w+)\}", name)
    skipped = f"skipped: set {', '.join(variables)} to the folder of recordings"
    if any(variable not in os.environ for variable in variables):
        raise CampaignError(skipped)
    path = folder / re.sub(r"\$\{(\w+)\}", lambda match: os.environ[match[1]], name)
    if not is_log(path):
        raise CampaignError(f"{skipped}; {path} is not there" if variables else f"no log {path}")
    return path


def _simulation(table: dict[str, Any] | None, folder: Path) -> Simulation | None:
    if table is None:
        return None
    _check(table, SIMULATE, "[simulate] ")
    if table.get("seed", 0) < 0:
        raise CampaignError("[simulate] seed: is to be 0 or more")
    if "trajectory" in table:
        table = table | {"trajectory": _file(table["trajectory"], folder)}
    return Simulation(**table)


def _tool(table: dict[str, Any] | None) -> Tool | None:
    if table is None:
        return None
    _check(table, TOOL, "[tool] ")
    if "mass" not in table:
        raise CampaignError("[tool] no mass")
    com = table.get("com", [])
    for value in com:
        _check({"com": value}, {"com": NUMBER}, "[tool] ")
    return tool_of((table["mass"], *com))


def _gains(values: list[Any] | None) -> tuple[float, ...] | None:
    for value in values or ():
        _check({"drive_gain": value}, {"drive_gain": NUMBER}, "")
    return None if values is None else tuple(map(float, values))


def _check(table: dict[str, Any], schema: dict[str, Any], where: str) -> None:
    """CampaignError at the first key that is unknown or of another type."""
    for key, value in table.items():
        if key not in schema:
            close = get_close_matches(key, schema, 1)
            hint = f"did you mean {close[0]}?" if close else f"known are {', '.join(schema)}"
            raise CampaignError(f"{where}unknown key {key!r}; {hint}")
        if not isinstance(value, schema[key]) or isinstance(value, bool):
            raise CampaignError(f"{where}{key}: {value!r} is to be {WORDS[schema[key]]}")
