"""The ground truth of a virtual arm, as a document that tests and people can read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError
from urdyn.io.document import dump_toml
from urdyn.io.files import write_text
from urdyn.io.writer import write
from urdyn.model.body import about_com
from urdyn.model.drive import UNITS
from urdyn.model.dynamics import Dynamics
from urdyn.simulate.deviations import frames
from urdyn.simulate.faults import Fault, describe
from urdyn.simulate.schedule import Event
from urdyn.simulate.sensors import Sensors
from urdyn.simulate.unfolding import unfolding, varying
from urdyn.types import Array, Log
from urdyn.version import __version__


def truth(
    dynamics: Dynamics, sensors: Sensors, seed: int, events: Sequence[Event] = (), end: float = 0.0
) -> dict[str, Any]:
    """A virtual arm on its first day: numbers in SI, joints and links base first.

    If anything happens to it until `end` [s], also the schedule of faults, and the course: every
    parameter that changes, as a list by name, with the times t.
    """
    arm, drive = dynamics.arm, dynamics.drive
    first_day = {
        "urdyn": __version__,
        "robot": arm.name,
        "seed": seed,
        "drive_gain": drive.gain.tolist(),
        "time_offset": drive.time_offset,
        "friction_lead": drive.friction_lead,
        "noise": _noise(sensors),
        "joints": [_joint(dynamics, j) for j in range(arm.joints)],
        "links": [
            {"name": name} | _body(body)
            for name, body in zip(arm.link_names, dynamics.inertials, strict=True)
        ],
        "payload": _body(dynamics.payload) if dynamics.payload[0] else None,
        "kinematics": frames(arm),
    }
    if not events:
        return first_day
    schedule = [describe(event) for event in events if isinstance(event, Fault)]
    course = varying(unfolding(dynamics, events, end))
    return first_day | {"schedule": schedule, "course": course}


def write_truth(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write what `truth` returned, as JSON or TOML by the suffix of `path`.

    As .parquet it is only the course, one column per parameter, with the rest in a .json beside it.
    """
    match Path(path).suffix.lower():
        case ".json":
            write_text(path, json.dumps(document, indent=2, allow_nan=False) + "\n")
        case ".toml":
            # TOML has no null: without a payload there is no such table.
            write_text(path, dump_toml({k: v for k, v in document.items() if v is not None}))
        case ".parquet":
            require_course(path, document)
            columns = {name: np.array(values) for name, values in document["course"].items()}
            write(Log(columns.pop("t"), columns), path)
            rest = {name: value for name, value in document.items() if name != "course"}
            write_truth(Path(path).with_suffix(".json"), rest)
        case suffix:
            raise InputError(f"{path}: the truth is written as .json or .toml, not {suffix!r}")


def require_course(path: str | Path, document: Mapping[str, Any]) -> None:
    """InputError where a truth without a course is to be written as .parquet."""
    if Path(path).suffix.lower() == ".parquet" and not document.get("course"):
        raise InputError(f"{path}: nothing changes in this arm; write .json or .toml")


def _joint(dynamics: Dynamics, j: int) -> dict[str, Any]:
    values = {name: float(getattr(dynamics.drive, name)[j]) for name in UNITS}
    return {"name": dynamics.arm.joint_names[j]} | values


def _body(inertials: Array) -> dict[str, Any]:
    mass, com, inertia = about_com(inertials)
    return {"mass": mass, "com": com.tolist(), "inertia": inertia.tolist()}


def _noise(sensors: Sensors) -> dict[str, Any]:
    told = {
        "current": sensors.current_noise.tolist(),
        "colour": sensors.colour,
        "velocity": sensors.velocity_noise,
        "encoder_step": sensors.encoder_step,
    }
    bands = [
        {"time": band.time, "frequency": band.frequency, "share": band.share.tolist()}
        for band in sensors.bands
    ]
    return told | ({"bands": bands} if bands else {})
