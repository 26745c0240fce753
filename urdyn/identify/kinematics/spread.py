"""How far arms deviate from their drawings: the prior of a calibration."""

from __future__ import annotations

import numpy as np

from urdyn.model.geometry.hayati import Form
from urdyn.model.geometry.transmission import smoothness
from urdyn.types import Array

# Standard deviations of a, alpha, beta, d by joint, base first: root mean square over the factory
# calibrations of 12 arms (UR3 to UR16e). The factory also sets every joint's zero, to some 0.01
# mrad; theta is for a joint that was disassembled and reassembled since.
REBUILT = 1e-3  # [rad]
SPREAD = np.array(
    [
        [0.0, 0.0, 0.0, 2.9e-4, REBUILT],
        [1.6e-4, 7.7e-4, 0.0, 0.0, REBUILT],
        [3.3e-4, 5.2e-3, 2.1e-3, 0.0, REBUILT],
        [4.1e-4, 7.1e-3, 1.8e-3, 7.2e-4, REBUILT],
        [5.8e-5, 1.3e-3, 0.0, 6.5e-5, REBUILT],
        [8.0e-5, 1.0e-3, 0.0, 4.7e-4, REBUILT],
    ]
)
ANYWHERE = 10.0  # [m, rad] of base and tool: next to flat
SOFT = 3e-5  # [rad/(N m)] of joints: 30 kN m/rad and stiffer
UNEVEN = (5e-5, 1e-4, 2e-4, 4e-4)  # [rad] RMS of a joint's error over a turn: chosen by data


def geometry_spread(form: Form) -> Array:
    """(P,) prior standard deviations of the geometry's coordinates [m, rad]."""
    known = len(form.joint_names) == len(SPREAD)
    seldom = np.where(SPREAD > 0.0, SPREAD, np.nan)
    typical = np.broadcast_to(np.nanmedian(seldom, axis=0), form.nominal.shape)
    spread = np.where(SPREAD > 0.0, SPREAD, typical) if known else typical
    return np.asarray(spread[form.free])


def effects_spread(orders: Array, uneven: float) -> Array:
    """(F,) prior standard deviations of effects' coefficients.

    Args:
        orders: harmonics' orders; 0 is compliance.
        uneven: RMS of a joint's error over a turn [rad].
    """
    most = orders.max(initial=0.0)
    if most == 0.0:
        return np.full(len(orders), SOFT)
    power = smoothness(np.arange(1.0, most + 1.0)).sum()  # a sine and a cosine together have RMS 1
    return np.where(orders > 0.0, uneven * np.sqrt(smoothness(orders) / power), SOFT)
