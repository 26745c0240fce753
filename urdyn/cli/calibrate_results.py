"""The folder of a calibration, and poses as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import urdyn as ud
from urdyn.identify.kinematics import Calibration, document, most_informative
from urdyn.identify.kinematics.calibration import rank_at
from urdyn.io import dump_toml, write_text
from urdyn.io.calibration_file import calibration_text
from urdyn.model.arm import Arm
from urdyn.model.describe import describe
from urdyn.model.geometry.drawing import redrawn
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
    out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(FILES, texts, strict=True):
        write_text(out / name, text)


def suggested(calibration: Calibration, count: int) -> Array:
    """Poses (count, J) [rad] that would tell most of what a calibration leaves open."""
    geometric = calibration.geometric
    known = rank_at(geometric, geometric.sought, calibration.poses)[1]
    rng = np.random.default_rng(0)
    return most_informative(calibration.arm, geometric.placement, count, rng, known)


def as_csv(arm: Arm, q: Array) -> str:
    """Poses (N, J) [rad] with the joints' names above them."""
    rows = (",".join(f"{angle:.6f}" for angle in row) for row in q)
    return "\n".join([",".join(arm.joint_names), *rows]) + "\n"
