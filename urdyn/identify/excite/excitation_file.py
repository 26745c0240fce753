"""excitation.toml, and the other files of an excitation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from urdyn.errors import InputError
from urdyn.identify.excite.cell_file import cell_of, document_of
from urdyn.identify.excite.excitation import Ask, Excitation
from urdyn.io import dump_toml, load_toml
from urdyn.io.motion_files import URSCRIPT_JOINTS, joint_trajectory, motion_csv, urscript
from urdyn.model.arm import described, load_arm, read_arm
from urdyn.simulate import Payload
from urdyn.simulate.limits import Limits
from urdyn.simulate.written import motion_document, read_motion
from urdyn.version import __version__

if TYPE_CHECKING:
    from urdyn.model.arm import Arm
    from urdyn.simulate.fourier import Series
    from urdyn.simulate.moves import Moves
    from urdyn.types import Array

FORMAT = 1
KNOT = 0.04  # [s] between poses in URScript and ROS 2; between them both are exact to 1e-6 rad
LIMITS = ("lower", "upper", "velocity", "acceleration", "torque")


def texts(found: Excitation) -> dict[str, str]:
    """CSV, ROS 2 YAML, TOML, and for arms of six joints URScript, by the files' names."""
    rows, title = found.trajectory, _title(found)
    t = np.arange(np.ceil(rows.t[-1] / KNOT - 1e-9) + 1.0) * KNOT
    q, v, a = found.path.at(np.minimum(t, rows.t[-1]))
    files = {
        "excitation.csv": "".join(motion_csv(rows.t, rows.q, rows.v, rows.a)),
        "excitation.yaml": joint_trajectory(t, q, v, a, found.arm.joint_names, title),
        "excitation.toml": dump_toml(excitation_document(found)),
    }
    if found.arm.joints == URSCRIPT_JOINTS:
        files["excitation.script"] = urscript(t, q, v, title)
    return files


def excitation_document(found: Excitation) -> dict[str, Any]:
    """All that is needed to reproduce the motion, and what was proven of it."""
    ask, arm = found.ask, found.arm
    document: dict[str, Any] = {
        "urdyn": {"version": __version__, "format": FORMAT},
        "robot": {"name": arm.name} | described(arm),
        "asked": {
            "kind": ask.kind,
            "criterion": ask.criterion,
            "interest": list(ask.interest),
            "joint": ask.joint,
            "margin": ask.margin,
            "seed": ask.seed,
            "twin": ask.twin,
        },
    }
    if ask.payload is not None:
        document["payload"] = {"mass": ask.payload.mass, "com": ask.payload.com}
    limits = {name: getattr(ask.limits, name) for name in LIMITS}
    proof = {"clearance": found.proof.clearance, "closest": list(found.proof.closest)}
    return document | {
        "limits": limits,
        "cell": document_of(ask.cell),
        "proven": proof | found.proof.shares,
        "motion": motion_document(found.path, ask.duration, ask.rate),
    }


def read_excitation(file: Path) -> tuple[Arm, Ask, Series | Moves]:
    """The arm, the request and the motion; InputError where the file lacks them."""
    document = load_toml(file)
    try:
        arm = _arm(document)
        asked = document["asked"]
        payload = document.get("payload")
        ask = Ask(
            kind=str(asked["kind"]),
            criterion=str(asked["criterion"]),
            interest=tuple(map(str, asked["interest"])),
            joint=int(asked["joint"]),
            margin=float(asked["margin"]),
            seed=int(asked["seed"]),
            twin=str(asked.get("twin", "")),
            payload=Payload(float(payload["mass"]), np.array(payload["com"])) if payload else None,
            limits=_limits(document["limits"], arm),
            cell=cell_of(document["cell"]),
        )
        path, duration, rate = read_motion(file, arm.joints)
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(
            f"{file}: not an excitation ({type(error).__name__}: {error}); write it with "
            "`urdyn excite`"
        ) from None
    except InputError as error:
        raise InputError(f"{file}: {str(error).removeprefix(f'{file}: ')}") from None
    return arm, replace(ask, duration=duration, rate=rate), path


def _arm(document: dict[str, Any]) -> Arm:
    robot = document["robot"]
    if "urdf" in robot:
        return read_arm(str(robot["urdf"]), str(robot["name"]))
    return load_arm(str(robot["name"]))


def _limits(table: dict[str, Any], arm: Arm) -> Limits:
    found: dict[str, Array] = {name: np.array(table[name], dtype=np.float64) for name in LIMITS}
    for name, values in found.items():
        if values.shape != (arm.joints,) or not np.isfinite(values).all():
            raise InputError(f"[limits] {name}: is to be {arm.joints} numbers")
    return Limits(**found)


def _title(found: Excitation) -> str:
    ask = found.ask
    return (
        f"{found.arm.name}, {ask.kind} excitation of {ask.duration:g} s, seed {ask.seed}; "
        f"urdyn {__version__}"
    )
