"""The kinematic calibration of UR's ROS driver: a YAML file with a frame for every link.

Angles are roll, pitch, yaw about fixed axes, as the driver's description reads them. Triples near
(pi, pi, pi) turn by nearly nothing: frames are read as matrices and never compared by angles.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from urdyn.errors import InputError
from urdyn.io.plain import finite
from urdyn.types import Array

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
PLACE, TURN = ("x", "y", "z"), ("roll", "pitch", "yaw")
LARGEST = 1 << 20  # [bytes]; such a file has about a thousand


def read_calibration(path: str | Path) -> Array:
    """Frames of the six joints in the links before them, (6, 4, 4) [m]; InputError if none."""
    try:
        data = Path(path).read_bytes()
        if len(data) > LARGEST:
            raise InputError(f"{path}: is no calibration: {len(data)} bytes are too many")
        document = yaml.safe_load(data)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{path}:{mark.line + 1}" if mark else str(path)
        raise InputError(f"{where}: is not YAML: {getattr(error, 'problem', error)}") from None
    frames = document.get("kinematics") if isinstance(document, dict) else None
    if not isinstance(frames, dict):
        raise InputError(f"{path}: is no calibration: it has no map called 'kinematics'")
    return np.array([_frame(frames.get(link), link, path) for link in LINKS])


def _frame(told: Any, link: str, path: str | Path) -> Array:
    """One frame, (4, 4)."""
    if not isinstance(told, dict):
        raise InputError(f"{path}: is no calibration: 'kinematics' has no frame of {link!r}")
    frame = np.eye(4)
    frame[:3, 3] = [_number(told, key, link, path) for key in PLACE]
    turn = [_number(told, key, link, path) for key in TURN]
    frame[:3, :3] = Rotation.from_euler("xyz", turn).as_matrix()
    return frame


def _number(told: dict[Any, Any], key: str, link: str, path: str | Path) -> float:
    value = told.get(key)
    if isinstance(value, str):  # YAML reads 1e-05 as a word
        with suppress(ValueError):
            value = float(value)
    number = finite(value)
    if number is None:
        said = f"{value!r:.20}"  # it may have 400 digits
        raise InputError(f"{path}: {key} of {link} is {said}, not a finite number")
    return number


def calibration_text(origins: Array, provenance: str = "") -> str:
    """The file's text: it reads back as the same frames (6, 4, 4); `provenance` heads it."""
    lines = [f"# {line}" for line in provenance.splitlines()] + ["kinematics:"]
    turns = Rotation.from_matrix(origins[:, :3, :3]).as_euler("xyz")
    for link, place, turn in zip(LINKS, origins[:, :3, 3], turns, strict=True):
        lines.append(f"  {link}:")
        values = (*place.tolist(), *turn.tolist())
        lines += [f"    {k}: {_written(v)}" for k, v in zip((*PLACE, *TURN), values, strict=True)]
    digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()
    return "\n".join([*lines, f"  hash: calib_{int(digest[:16], 16)}"]) + "\n"


def _written(value: float) -> str:
    """A number that YAML reads as one: with a point also before an exponent."""
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
