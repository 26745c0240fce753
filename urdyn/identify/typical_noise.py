"""The noise of an arm's currents before any was measured: that of recordings of such arms."""

from __future__ import annotations

import numpy as np

from urdyn.identify.noise import MAX_ORDER, Noise, regressed
from urdyn.identify.slow import MEMORY
from urdyn.model.arm import Arm
from urdyn.simulate import real_sensors


def typical_noise(arm: Arm, step: float) -> Noise:
    """What recordings show beside any model, in rows `step` [s] apart or a cycle, if longer."""
    sensors = real_sensors(arm)
    step = max(step, sensors.cycle)
    lags = np.linspace(0.0, MAX_ORDER * step, MAX_ORDER + 1)
    each = np.array([band.correlation(lags) for band in sensors.bands])
    lasts = np.array([band.time >= MEMORY for band in sensors.bands])
    quick, share = each[~lasts].sum(axis=0), each[lasts, 0].sum(axis=0)
    quick[0] = 1.0 - share  # with what is white
    sd = sensors.current_noise
    return regressed(quick * sd**2, np.sqrt(share) * sd, step)
