"""Quantities of interest: what a belief means to the people who run the robot.

The step phi_QoI of the network [Kapteyn2021]_: margins, energy and predictive error follow from
the belief and the motion; they are kept as sums and extremes, so that they need no history.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdyn.dbn.robot import RobotCurrents
from urdyn.io.plain import plain
from urdyn.tracking.belief.physical import Quantities, weighed
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.belief.spare_payload import spare_payload
from urdyn.types import NORMAL90, Array

LONGEST = 1.0  # [s] between two readings that count as one motion


@dataclass(frozen=True, eq=False)
class Interest:
    """What a run has shown so far; J joints."""

    t: float  # [s] of the newest reading
    seconds: float  # [s] that the sums cover, rests included
    # (J,) [-] largest share of the torque that a healthy drive can give, by the commissioned gain
    used: Array
    used_sd: Array  # (J,) [-] of that share, by that gain
    scale: Array  # (2, J) [-] gain per commissioned gain, as last believed, and its sd
    spare: float  # [kg] payload that could have been added where that surely is least
    spare_sd: float  # [kg]
    work: Array  # (J,) [J] mechanical energy that the drives gave
    lost: Array  # (J,) [J] of that, lost to friction
    samples: Array  # (J,) compared
    # (3, J) [A²] sums of squares: measured minus modelled, measured minus the commissioned model,
    # and measured
    squares: Array


def nothing_yet(joints: int) -> Interest:
    """Nothing gathered yet, before the first reading."""
    nothing = np.zeros(joints)
    return Interest(
        t=np.nan,
        seconds=0.0,
        used=nothing,
        used_sd=nothing,
        scale=np.stack([nothing + 1.0, nothing]),
        spare=np.inf,
        spare_sd=0.0,
        work=nothing,
        lost=nothing,
        samples=nothing,
        squares=np.zeros((3, joints)),
    )


def strained(so_far: Interest, reading: Reading, currents: RobotCurrents) -> Interest:
    """With one reading's share of the drives' torque: for every reading, as peaks are short.

    It is the predicted one, which noise does not raise; the measured one where that is surer.
    """
    per = currents.reference.drive.gain / currents.reference.arm.effort_limit
    most = np.fmax(np.abs(reading.modelled), np.abs(reading.current))
    if not (most * per > so_far.used).any():  # whichever of the two counts
        return so_far
    sd, noise = _doubt(reading, currents), np.sqrt(currents.observe_cov(reading.inputs).diagonal())
    measured = np.isfinite(reading.current) & (sd > np.sqrt(2.0) * noise)
    share = np.abs(np.where(measured, reading.current, reading.modelled)) * per
    more, sd = share > so_far.used, np.where(measured, noise, sd) * per
    if not more.any():
        return so_far
    used = np.where(more, share, so_far.used)
    return replace(so_far, used=used, used_sd=np.where(more, sd, so_far.used_sd))


def after(
    so_far: Interest, reading: Reading, of: Quantities, commissioned: Array, due: bool
) -> Interest:
    """With one more reading: its peaks and their margins, and the sums if `due` or a payload came.

    Sums over peaks as well would be sums over unusual rows.
    """
    found = strained(so_far, reading, of.currents)
    if due or reading.unknown:
        return gathered(found, reading, of, commissioned)
    return found if found is so_far else spared(found, reading, of)


def spared(so_far: Interest, reading: Reading, of: Quantities) -> Interest:
    """With the least payload that could have been added, and the gains as believed now."""
    belief, gain = reading.belief, of.currents.places["gain"]
    scale = np.stack([np.exp(belief.mean[gain]), np.hypot(belief.sd[gain], of.taken["payload"])])
    least = so_far.spare, so_far.spare_sd
    if reading.unknown:  # another payload has another margin
        least = np.inf, 0.0
    if weighed(belief, of.currents):
        # Of the least of many, each somewhat wrong, most would be too small.
        least = min(least, spare_payload(reading, of), key=lambda kg: kg[0] + NORMAL90 * kg[1])
    return replace(so_far, scale=scale, spare=least[0], spare_sd=least[1])


def gathered(so_far: Interest, reading: Reading, of: Quantities, commissioned: Array) -> Interest:
    """With one more reading; `commissioned` is the state's mean on the first day, (n,)."""
    currents, u, x = of.currents, reading.inputs, reading.belief.mean
    drive = currents.reference.drive
    passed = reading.t - so_far.t
    dt = passed if 0.0 < passed < LONGEST else 0.0
    torque = currents.observe(x, u) * drive.gain * np.exp(x[currents.places["z"]])
    # Residuals of the models alone: what the noise's colour predicts is no merit of the belief.
    residual = reading.current - np.stack([reading.modelled, currents.observe(commissioned, u)])
    compared = np.isfinite(reading.innovation.residual)
    values = np.where(compared, np.vstack([residual, reading.current]), 0.0)
    friction = currents.friction(x, u)
    return replace(
        spared(so_far, reading, of),
        t=reading.t,
        seconds=so_far.seconds + dt,
        work=so_far.work + np.maximum(torque * u.v, 0.0) * dt,
        lost=so_far.lost + np.maximum(friction * u.v, 0.0) * dt,
        samples=so_far.samples + compared,
        squares=so_far.squares + values**2,
    )


def as_plain(
    interest: Interest, joint_names: tuple[str, ...], rest: tuple[float, float] = (np.inf, 0.0)
) -> dict[str, Any]:
    """The quantities in plain numbers, as `urdyn track` prints them.

    Args:
        rest: what the arm's rating leaves beside its load, and its sd [kg]; less than 0 where it
            is overloaded.
    """
    residual, before, current = interest.squares
    n = np.where(interest.samples > 0, interest.samples, np.nan)
    seconds = max(interest.seconds, 1e-9)
    scale, doubt = interest.scale
    rows = {
        "torque_margin": 1.0 - scale * interest.used,
        "torque_margin_sd": scale * np.hypot(interest.used_sd, doubt * interest.used),
        "power_W": interest.work / seconds,
        "friction_power_W": interest.lost / seconds,
        "rmse_A": np.sqrt(residual / n),
        "rre_percent": _percent(residual, current),
        "commissioned_rre_percent": _percent(before, current),
    }
    joints = [
        {"name": name} | {key: plain(row[j]) for key, row in rows.items()}
        for j, name in enumerate(joint_names)
    ]
    torque = _margin(interest.spare, interest.spare_sd)
    return {
        "joints": joints,
        "payload_margin_kg": _least(torque, rest),
        "torque_payload_margin_kg": torque,
        "energy_J": float(interest.work.sum()),
        "friction_J": float(interest.lost.sum()),
    }


def _margin(value: float, sd: float) -> dict[str, Any]:
    return {"value": plain(value), "sd": plain(sd)}


def _least(torque: dict[str, Any], rest: tuple[float, float]) -> dict[str, Any]:
    """The smaller of two margins, and `by` which of them it is; None where it is not known."""
    margins = {"torque": torque, "rating": _margin(*rest)}
    told = {name: margin for name, margin in margins.items() if margin["value"] is not None}
    if not told or np.isnan(rest[0]):  # what is left of a rating that binds is not known
        return _margin(np.nan, np.nan) | {"by": None}
    by = min(told, key=lambda name: told[name]["value"])
    return told[by] | {"by": by}


def _doubt(reading: Reading, currents: RobotCurrents) -> Array:
    """Standard deviation of the current predicted by the belief, (J,) [A]."""
    H = currents.observe_jacobian(reading.belief.mean, reading.inputs)
    P = reading.belief.cov[: H.shape[1], : H.shape[1]]  # the rates do not affect the current
    return np.asarray(np.sqrt(np.diag(H @ P @ H.T + currents.observe_cov(reading.inputs))))


def _percent(part: Array, whole: Array) -> Array:
    return np.asarray(100.0 * np.sqrt(part / np.where(whole > 0, whole, np.nan)))
