"""The folder of a calibration, and poses as a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import urdyn as ud
from urdyn.identify.kinematics import Calibration, document, most_informative
from urdyn.identify.kinematics.calibration import rank_at
from urdyn.io import dump_toml, sha256, write_folder
from urdyn.io.calibration_file import calibration_text
from urdyn.model.arm import Arm
from urdyn.model.describe import describe
from urdyn.model.geometry.dh import deltas_of
from urdyn.model.geometry.drawing import drawing_of, redrawn
from urdyn.model.geometry.turns import places_of
from urdyn.types import Array

FILES = ("kinematics.yaml", "calibrated.urdf", "calibration.toml", "report.html")


def save(calibration: Calibration, page: str, out: Path) -> None:
    """Write FILES; all are made before any is written."""
    source, table = calibration.poses.source, calibration.geometric.placement.table
    heading = f"urdyn {ud.__version__}: calibrated from {source.path} (sha256 {source.sha256[:12]})"
    arm = redrawn(calibration.arm, table)
    texts = (
        calibration_text(places_of(table), heading),
        describe(arm, arm.inertials, heading),
        dump_toml(document(calibration)),
        page,
    )
    write_folder(out, dict(zip(FILES, texts, strict=True)))


def exchange(arm: Arm, table: Array, path: Path, out: Path) -> dict[str, Any]:
    """Write a geometry a ... theta `table` (J, 5) in other tools' formats; return its numbers."""
    heading = f"urdyn {ud.__version__}: from {path} (sha256 {sha256(path)[:12]})"
    form, built = drawing_of(arm).form, redrawn(arm, table)
    texts = calibration_text(places_of(table), heading), describe(built, built.inertials, heading)
    write_folder(out, dict(zip(FILES[:2], texts, strict=True)))
    off, deltas = (table - form.nominal)[form.free].tolist(), deltas_of(form, table)
    return {
        "robot": arm.name,
        "parameters": {
            name: {"value": value, "unit": unit}
            for name, value, unit in zip(form.names, off, form.units, strict=True)
        },
        "dh_deltas": {
            name: getattr(deltas, name).tolist() for name in ("theta", "d", "a", "alpha")
        },
    }


def suggested(calibration: Calibration, count: int) -> Array:
    """Poses (count, J) [rad] that would best determine what a calibration leaves open."""
    geometric = calibration.geometric
    known = rank_at(geometric, geometric.sought, calibration.poses)[1]
    rng = np.random.default_rng(0)
    return most_informative(calibration.arm, geometric.placement, count, rng, known)


def as_csv(arm: Arm, q: Array) -> str:
    """Poses (N, J) [rad] with the joints' names above them."""
    rows = (",".join(f"{angle:.6f}" for angle in row) for row in q)
    return "\n".join([",".join(arm.joint_names), *rows]) + "\n"
