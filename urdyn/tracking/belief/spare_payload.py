"""What more an arm could carry where it is, before a drive reaches its limit.

With d the torque of a kilogram and m the kilograms added, the first joint that reaches its limit
tells

    tau = load + m d + beta |load + m d| s + rest = sign(d) z tau_max

They are added at the centre of what is carried, c = m h / (m² + var m): at the flange where that
may be nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from urdyn.model.arm import Arm
from urdyn.model.rated_payload import rated_payload
from urdyn.tracking.belief.physical import PAYLOAD, Quantities
from urdyn.tracking.belief.reading import Reading


def rest_of(arm: Arm, final: Mapping[str, Any], known: bool) -> tuple[float, float]:
    """What an arm's rating leaves beside its load, and its sd [kg]; inf where it has none.

    Args:
        final: quantities as in a summary.
        known: whether motion has told the load; else both are NaN.
    """
    if not known and np.isfinite(rated_payload(arm)):
        return np.nan, np.nan
    load = final["payload.mass"]
    return rated_payload(arm) - load["mean"], load["sd"]


def spare_payload(reading: Reading, of: Quantities) -> tuple[float, float]:
    """Mass that could be added here [kg], infinite where no torque is too much, and its sd.

    The sd is that of all of the equation by the belief, of the current's noise, and of the scale of
    all torques, as the rated ones are in newton metres.
    """
    currents, belief, u = of.currents, reading.belief, reading.inputs
    x, at, beta = belief.mean, currents.places, np.exp(belief.mean[currents.places["beta"]])
    gain = currents.reference.drive.gain * np.exp(x[at["z"]] + x[at["gain"]])
    current, by_state = currents.linearised(x, u)
    scale, torque = np.exp(x[at["gain"]]), current * gain
    carried = slice(at["payload"].start, at["payload"].start + len(PAYLOAD))
    m, *h = of.payload(belief)
    whole = float(m**2 + belief.cov[carried, carried][0, 0]) or np.inf
    shift = m / whole  # [1/kg] of the centre, per first moment
    A, load = u.A[:, carried], currents.load(x, u) * scale
    d = A @ [1.0, *(shift * np.array(h))]
    rest = torque - load - beta * np.abs(load) * u.s
    health = np.minimum(np.exp(x[at["z"]]), 1.0)
    limit = np.copysign(currents.reference.arm.effort_limit * health, d)
    bears = np.abs(d) > 1e-9
    if not bears.any():
        return np.inf, 0.0
    steep = np.where(bears, d * (1.0 + beta * np.sign(d) * u.s), np.nan)  # [N·m/kg] at the drive
    room = (limit - rest) / steep - load / np.where(bears, d, np.nan)
    j = int(np.nanargmin(room))
    if room[j] == np.inf:  # no torque is too much
        return np.inf, 0.0
    # Derivative of limit - rest at the heavier load, by every state but the rates.
    slope = -gain[j] * by_state[j]
    slope[at["z"]][j] += limit[j] * (health[j] < 1.0) - torque[j]
    slope[at["gain"]][j] -= torque[j]
    more = np.abs(load + room * d) - np.abs(load)
    slope[at["beta"]][j] -= (beta * more * u.s)[j]
    by_moment, by_mass = A[j, 1:] * shift, A[j, 1:] @ h * (1.0 / whole - 2.0 * shift**2)  # of d
    slope[carried] -= room[j] * steep[j] / d[j] * np.array([by_mass, *by_moment])
    n = len(slope)
    variance = slope @ belief.cov[:n, :n] @ slope
    variance += gain[j] ** 2 * currents.observe_cov(u)[j, j]
    variance += torque[j] ** 2 * float(of.taken["payload"][0]) ** 2
    return max(0.0, float(room[j])), float(np.sqrt(variance) / abs(steep[j]))
