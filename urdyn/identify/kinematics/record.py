"""A calibration as a document, with all that is needed to score it elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import ArmError, InputError
from urdyn.identify.kinematics.calibration import Calibration, drawn, rms
from urdyn.identify.kinematics.placement import Placement
from urdyn.io import load_toml
from urdyn.io.calibration_file import read_calibration
from urdyn.model.arm import Arm
from urdyn.model.geometry.drawing import drawing_of, placed
from urdyn.model.geometry.hayati import KINDS
from urdyn.model.geometry.transmission import HARMONICS, Effects, no_effects
from urdyn.types import Array
from urdyn.version import __version__

FORMAT = 1
NAME, YAML = "calibration.toml", "kinematics.yaml"


@dataclass(frozen=True, eq=False)
class Recorded:
    """An earlier calibration of an arm: base and tool are those of its day."""

    geometric: Placement  # geometry alone
    full: Placement | None  # with joint effects, where these were preferred
    sha256: str = ""  # of the poses from which it was made
    cov: Array | None = None  # (P, P) of the geometry; None: not in the file


def document(calibration: Calibration) -> dict[str, Any]:
    """The calibration as nested tables, for TOML."""
    found, source = calibration.found, calibration.poses.source
    return {
        "format": FORMAT,
        "urdyn": __version__,
        "robot": calibration.arm.name,
        "source": {"path": source.path, "sha256": source.sha256, "poses": len(calibration.poses)},
        "model": calibration.choice.chosen.model.name,
        "rms_m": rms(found, calibration.sound),
        "trusted_elsewhere": calibration.verdict.trusted,
        "geometry_alone": _geometry(calibration.geometric.placement),
        "geometry": _geometry(found.placement) | _belief(calibration),
        "effects": _effects(found.placement),
        "frames": {"base": found.placement.base, "tool": found.placement.tool},
    }


def _geometry(placement: Placement) -> dict[str, Any]:
    """Rows of a, alpha, beta, d, theta [m, rad]."""
    return {"columns": list(KINDS), "table": placement.table}


def _belief(calibration: Calibration) -> dict[str, Any]:
    """Belief in the geometry's coordinates: deviations and covariance."""
    few = len(calibration.spread)
    return {"sd": calibration.sd[:few], "covariance": calibration.found.posterior.cov[:few, :few]}


def _effects(placement: Placement) -> dict[str, Any]:
    """Coefficients of joint effects [rad, rad/(N m)]."""
    effects = placement.effects
    return {
        "compliant": list(effects.compliant),
        "harmonics": effects.harmonics,
        "coefficients": placement.coefficients,
    }


def load_calibration(path: str | Path, arm: Arm) -> Recorded:
    """The calibration in a folder of `urdyn calibrate`, or in any kinematics.yaml.

    Raises:
        InputError: there is none, it is damaged, or it is of another type of arm.
    """
    path = Path(path)
    whole, plain = path / NAME, path / YAML if path.is_dir() else path
    start = drawn(arm, drawing_of(arm))
    if path.is_dir() and whole.is_file():
        return _read(load_toml(whole), whole, arm, start)
    if not plain.is_file():
        raise InputError(f"{path}: holds no calibration: neither {NAME} nor {YAML}")
    return Recorded(_placed(start, factory(plain, arm), no_effects(arm), np.zeros(0)), None)


def factory(path: str | Path, arm: Arm) -> Array:
    """(J, 5) a ... theta in a kinematics.yaml; InputError where it is damaged or absurd."""
    origins, form = read_calibration(path), drawing_of(arm).form
    try:
        return placed(form, origins, arm.name)
    except ArmError as error:
        raise InputError(f"{path}: {error}") from None


def _read(saved: Mapping[str, Any], path: Path, arm: Arm, start: Placement) -> Recorded:
    """A calibration.toml, checked."""
    try:
        if saved["format"] != FORMAT:
            raise InputError(f"{path}: is of format {saved['format']}, this urdyn reads {FORMAT}")
        if saved["robot"] != arm.name:
            raise InputError(f"{path}: is the calibration of a {saved['robot']}, not of {arm.name}")
        alone = _numbers(saved["geometry_alone"]["table"], start.table.shape)
        geometric = _placed(start, alone, no_effects(arm), np.zeros(0))
        compliant = tuple(int(j) for j in saved["effects"]["compliant"])
        harmonics = int(saved["effects"]["harmonics"])
        if not (set(compliant) <= set(range(arm.joints)) and 0 <= harmonics <= HARMONICS):
            raise ValueError("effects of joints that it does not have")
        effects = Effects(arm, compliant, harmonics)
        values = _numbers(saved["effects"]["coefficients"], (len(effects.owners),))
        table = _numbers(saved["geometry"]["table"], start.table.shape)
        full = _placed(start, table, effects, values) if len(values) else None
        return Recorded(geometric, full, str(saved["source"]["sha256"]), _covariance(saved, start))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: is no calibration of this urdyn: {error!r}") from None


def _covariance(saved: Mapping[str, Any], start: Placement) -> Array | None:
    """Covariance of the geometry; None in a file from before it was recorded."""
    if "covariance" not in saved["geometry"]:
        return None
    cov = _numbers(saved["geometry"]["covariance"], (len(start.deviations),) * 2)
    if np.abs(cov - cov.T).max() > 1e-9 * np.abs(cov).max() or np.linalg.eigvalsh(cov)[0] <= 0.0:
        raise ValueError("its covariance is none")
    return cov


def _numbers(given: Any, shape: tuple[int, ...]) -> Array:
    values = np.array(given, dtype=np.float64)
    if values.shape != shape or not all(map(math.isfinite, values.ravel())):
        raise ValueError(f"expected {shape} finite numbers, found {values.shape}")
    return values


def _placed(start: Placement, table: Array, effects: Effects, values: Array) -> Placement:
    return Placement(start.form, table, effects, values, start.base, start.tool)
