"""Results as plain numbers: what `--json` prints and every page is drawn from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from urdyn.identify import Fit, Score
from urdyn.io.plain import jsonable
from urdyn.model.body import BODY, centre_of_mass
from urdyn.model.friction import WORKING_SPEED
from urdyn.version import __version__

FRICTION = ("coulomb", "viscous", "structural", "offset", "rotor_inertia")


def identified(fit: Fit, wall: float) -> dict[str, Any]:
    """A fit in numbers; `wall` is the time that it took [s]."""
    arm, payloads = fit.dynamics.arm, range(len(fit.payloads))
    loads = [_payload(fit, f"payload_{k}") for k in payloads]
    return {
        "urdyn": __version__,
        "robot": arm.name,
        "n_samples": fit.n_samples,
        "n_parameters": fit.n_parameters,
        "rank": fit.rank,
        "wall_s": round(wall, 3),
        "drive_gain": fit.dynamics.drive.gain.tolist(),
        "drive_gain_sd": [fit.spread(f"{joint}.gain") for joint in arm.joint_names],
        "time_offset_s": fit.dynamics.drive.time_offset,
        "time_offset_sd_s": fit.spread("time_offset"),
        "friction_lead_s": fit.dynamics.drive.friction_lead,
        "joints": [_joint(fit, j) for j in range(arm.joints)],
        "links": [_link(fit, link) for link in arm.link_names],
        "tool": _tool(fit) if fit.tool_known else None,
        "payload": loads[-1] if loads else None,
        "payloads": loads,
        "logs": [{"path": s.path, "sha256": s.sha256, "rows": s.rows} for s in fit.sources],
    }


def _joint(fit: Fit, joint: int) -> dict[str, Any]:
    name = fit.dynamics.arm.joint_names[joint]
    optional = sorted(fit.terms[joint])
    shape = ["stribeck_velocity"] if "stribeck" in optional else []
    quantities = (*FRICTION, "presliding_distance", *optional, *shape)
    warm = float(fit.dynamics.drive.temperature[joint])  # at which viscous friction is quoted
    said = {"name": name, "terms": optional, "temperature_c": None if math.isnan(warm) else warm}
    at_work = fit.friction(WORKING_SPEED)
    slides = {"value": float(at_work.mean[joint]), "sd": float(at_work.sd[joint]), "unit": "N·m"}
    rows = {quantity: quantity_of(fit, f"{name}.{quantity}") for quantity in quantities}
    return said | {"friction": slides} | rows


def quantity_of(fit: Fit, name: str) -> dict[str, Any]:
    """Value, sd and unit of a physical parameter."""
    unit = fit.parameters.units[fit.parameters.names.index(name)]
    return {"value": fit.value(name), "sd": fit.spread(name), "unit": unit}


def _link(fit: Fit, link: str) -> dict[str, Any]:
    at = fit.parameters.names.index(f"{link}.mass")
    body = [fit.value(f"{link}.{x}") for x in BODY]
    mass = {
        "value": body[0],
        "sd": fit.spread(f"{link}.mass"),
        "prior": float(fit.prior[at]),
        "prior_sd": float(fit.prior_sd[at]),
        "informed": fit.informed(f"{link}.mass"),
        "unit": "kg",
    }
    return {"name": link, "mass": mass, "com": body[1:4], "inertia": body[4:]}


def _tool(fit: Fit) -> dict[str, Any]:
    tool = fit.dynamics.payload
    return {"mass": float(tool[0]), "com": np.nan_to_num(centre_of_mass(tool)).tolist()}


def _payload(fit: Fit, name: str) -> dict[str, Any]:
    com = [fit.value(f"{name}.{x}") for x in BODY[1:4]]
    return {
        "mass": fit.value(f"{name}.mass"),
        "sd": fit.spread(f"{name}.mass"),
        "com": com,
        "com_sd": [fit.spread(f"{name}.{x}") for x in BODY[1:4]],
        "inertia": [fit.value(f"{name}.{x}") for x in BODY[4:]],
    }


def validated(scores: Sequence[Score]) -> dict[str, Any]:
    """Scores in numbers; None where the log has no data."""
    return {"urdyn": __version__, "logs": [_score(score) for score in scores]}


def _score(score: Score) -> dict[str, Any]:
    source = score.log.source
    target = score.target_rre_percent
    return {
        "path": source.path,
        "sha256": source.sha256,
        "rows": source.rows,
        "n": len(score.log),
        "duration_s": score.duration,
        "rre_percent": jsonable(score.rre_percent),
        "rmse_A": jsonable(score.rmse),
        "target_current_rre_percent": jsonable(target) if np.isfinite(target).any() else None,
        "noise_floor_percent": jsonable(score.floor_percent),
        "standing": jsonable(score.standing),
        "moving_rre_percent": jsonable(score.moving_rre_percent),
        "coverage90": jsonable(score.coverage90),
        "defects": [str(defect) for defect in score.log.defects],
    }
