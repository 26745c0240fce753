"""The ground truth of a virtual arm, as a document that tests and people can read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from urdyn.errors import InputError
from urdyn.io.document import dump_toml
from urdyn.io.files import write_text
from urdyn.model.body import about_com
from urdyn.model.drive import UNITS
from urdyn.model.dynamics import Dynamics
from urdyn.simulate.sensors import Sensors
from urdyn.types import Array


def truth(dynamics: Dynamics, sensors: Sensors, seed: int) -> dict[str, Any]:
    """What a virtual arm is: numbers in SI, joints and links base first."""
    arm, drive = dynamics.arm, dynamics.drive
    return {
        "robot": arm.name,
        "seed": seed,
        "drive_gain": drive.gain.tolist(),
        "time_offset": drive.time_offset,
        "noise": _noise(sensors),
        "joints": [_joint(dynamics, j) for j in range(arm.joints)],
        "links": [
            {"name": name} | _body(body)
            for name, body in zip(arm.link_names, dynamics.inertials, strict=True)
        ],
        "payload": _body(dynamics.payload) if dynamics.payload[0] else None,
    }


def write_truth(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write what `truth` returned, as JSON or TOML by the suffix of `path`."""
    match Path(path).suffix.lower():
        case ".json":
            write_text(path, json.dumps(document, indent=2) + "\n")
        case ".toml":
            # TOML has no null: an arm without payload has no table of it.
            write_text(path, dump_toml({k: v for k, v in document.items() if v is not None}))
        case suffix:
            raise InputError(f"{path}: the truth is written as .json or .toml, not {suffix!r}")


def _joint(dynamics: Dynamics, j: int) -> dict[str, Any]:
    values = {name: float(getattr(dynamics.drive, name)[j]) for name in UNITS}
    return {"name": dynamics.arm.joint_names[j]} | values


def _body(inertials: Array) -> dict[str, Any]:
    mass, com, inertia = about_com(inertials)
    return {"mass": mass, "com": com.tolist(), "inertia": inertia.tolist()}


def _noise(sensors: Sensors) -> dict[str, Any]:
    return {
        "current": sensors.current_noise.tolist(),
        "colour": sensors.colour,
        "velocity": sensors.velocity_noise,
        "encoder_step": sensors.encoder_step,
    }
