"""A calibration as plain numbers: what `--json` prints and its page is drawn from."""

from __future__ import annotations

from typing import Any

import numpy as np

from urdyn.identify.kinematics import Calibration, Evaluation
from urdyn.identify.kinematics.evaluation import NOMINAL
from urdyn.identify.kinematics.robust import Found
from urdyn.io.plain import plain
from urdyn.types import Array, Mask
from urdyn.version import __version__


def calibrated(c: Calibration, wall: float) -> dict[str, Any]:
    """A calibration in numbers; `wall` is the time that it took [s]."""
    return {
        "urdyn": __version__,
        "robot": c.arm.name,
        **scores(c.found, c.nominal, c.sound),
        "rank": c.rank,
        "n_parameters": c.sought,
        "wall_s": round(wall, 3),
        "model": c.choice.chosen.model.name,
        "geometry_alone_rms_mm": 1e3 * _rms(c.geometric.residuals[c.sound, :3]),
        "geometry_alone_held_out": _held_out(c.choice.stripped),
        "held_out": {t.model.name: _held_out(t.rms) for t in c.choice.trials},
        "trusted_elsewhere": c.verdict.trusted,
        "reasons": list(c.verdict.reasons),
        "expected_tcp_error_mm": _quantiles(c.space.error),
        "expected_before_mm": _quantiles(c.space.before),
        "parameters": parameters(c),
        "tool": _frame(c.found.placement.tool),
        "base": _frame(c.found.placement.base),
        "tool_at_flange": c.bare,
        "trade_offs": [
            {"name": w.name, "left": w.left, "with": [list(pair) for pair in w.partners]}
            for w in c.weak
        ],
        "proposed_poses": c.proposed.tolist(),
        "source": {"path": c.poses.source.path, "sha256": c.poses.source.sha256},
        "defects": [str(defect) for defect in c.poses.defects],
    }


def evaluated(e: Evaluation, wall: float) -> dict[str, Any]:
    """A calibration's score on other poses, in numbers."""
    found = e.fits[e.best]
    deviations = found.placement.deviations.tolist()
    names, units = e.drawing.form.names, e.drawing.form.units
    return {
        "urdyn": __version__,
        "robot": e.arm.name,
        **scores(found, e.fits[NOMINAL], e.sound),
        "rank": e.rank,
        "n_parameters": e.sought,
        "wall_s": round(wall, 3),
        "model": e.best,
        "models": {
            name: {"rms_mm": 1e3 * _rms(fit.residuals[e.sound, :3])} for name, fit in e.fits.items()
        },
        "parameters": {
            name: {"value": value, "unit": unit}
            for name, value, unit in zip(names, deviations, units, strict=True)
        },
        "source": {"path": e.poses.source.path, "sha256": e.poses.source.sha256},
        "defects": [str(defect) for defect in e.poses.defects],
    }


def scores(found: Found, nominal: Found, sound: Mask) -> dict[str, Any]:
    """Residual errors, without gross errors; None where rotations were not measured."""
    left = found.residuals[sound]
    turn = _rms(left[:, 3:])
    return {
        "n": int(sound.sum()),
        "gross": int((~sound).sum()),
        "rms_mm": 1e3 * _rms(left[:, :3]),
        "p95_mm": 1e3 * float(np.quantile(np.linalg.norm(left[:, :3], axis=1), 0.95)),
        "rms_mrad": plain(1e3 * turn),
        "nominal_rms_mm": 1e3 * _rms(nominal.residuals[sound, :3]),
    }


def parameters(c: Calibration) -> dict[str, Any]:
    """Deviations from the drawing, and joints' compliances where the model has them."""
    form, effects = c.drawing.form, c.found.placement.effects
    soft = len(effects.compliant)
    first = len(c.sd) - len(c.found.placement.coefficients)
    names = (*form.names, *effects.names[:soft])
    units = (*form.units, *["rad/(N m)"] * soft)
    values = np.concatenate([c.found.placement.deviations, c.found.placement.coefficients[:soft]])
    sd = np.concatenate([c.sd[: len(form.names)], c.sd[first : first + soft]])
    prior = dict(zip(form.names, c.spread.tolist(), strict=True))
    return {
        name: {"value": float(v), "sd": float(s), "unit": unit, "prior_sd": prior.get(name)}
        for name, v, s, unit in zip(names, values, sd, units, strict=True)
    }


def _held_out(regions: Array) -> dict[str, Any]:
    """Errors in regions that were held out [mm]."""
    return {
        "rms_mm": 1e3 * float(np.sqrt((regions**2).mean())),
        "worst_mm": 1e3 * float(regions.max()),
        "regions": len(regions),
    }


def _rms(e: Array) -> float:
    return float(np.sqrt((e**2).sum(axis=1).mean()))


def _quantiles(lengths: Array) -> dict[str, float]:
    """[mm]"""
    low, middle, high = 1e3 * np.quantile(lengths, [0.05, 0.5, 0.95])
    return {"p5": float(low), "median": float(middle), "p95": float(high)}


def _frame(pose: Array) -> dict[str, Any]:
    from urdyn.model.geometry.drawing import angles

    return {"xyz_m": pose[:3, 3].tolist(), "rpy_rad": angles(pose).tolist()}
