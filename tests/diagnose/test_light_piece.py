"""A piece that no moment tells is known before it has bent what the program teaches."""

from __future__ import annotations

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.residual.rows import rows
from urdyn.diagnose.residual.warmth import unfelt
from urdyn.simulate import Payload, observe, real_sensors
from urdyn.simulate.work import pick_and_place

PIECE, SECONDS, RATE = 0.4, 75.0, 20.0  # [kg], [s], [Hz]


@pytest.mark.parametrize("seed", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_a_light_piece_is_known_within_a_minute(shop: Shop, seed: int) -> None:
    rng = np.random.default_rng(seed)
    piece = Payload(PIECE, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(shop.dynamics.arm, SECONDS, RATE, rng, piece)
    sensors = real_sensors(shop.dynamics.arm)
    log = observe(shop.dynamics, work.trajectory, sensors, rng, work.handling)
    motion, s, moved = shop.motion(log)
    diagnosis = shop.diagnosis(log)
    state = diagnosis.init()
    for k in range(0, len(motion), 5):
        here = rows(
            diagnosis.space, motion.slice(k, k + 5), s[k : k + 5], moved[k : k + 5], unfelt(6)
        )
        state, found = diagnosis.take(state, here)
        assert found == []
    _, *others = state.slow.carrying.modes
    assert min(abs(mode.mean[0] - PIECE) for mode in others) < 0.1
