"""The probe of a joint shows a gap in its gear, by the criterion that later judges the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.backlash import Backlash
from urdyn.diagnose.observability import Observability
from urdyn.diagnose.pace import BEAT
from urdyn.diagnose.rows import rows
from urdyn.diagnose.rules_file import read_rules
from urdyn.diagnose.space import space
from urdyn.diagnose.warmth import unfelt
from urdyn.identify.excite.probe import LEAST, probe
from urdyn.identify.excite.proof import Safe
from urdyn.model.cell import STANDING
from urdyn.model.collision import collider
from urdyn.simulate import Trajectory
from urdyn.simulate.limits import GENTLE_ACCELERATION, comfortable
from urdyn.simulate.trajectory import grid

RATE = 500.0


@pytest.mark.parametrize(
    ("joint", "acceleration"), [(0, GENTLE_ACCELERATION), (1, GENTLE_ACCELERATION), (2, 8.0)]
)
def test_the_probe_of_a_joint_shows_a_milliradian(
    shop: Shop, joint: int, acceleration: float
) -> None:
    """Of a sound arm without noise: what a gap would have shown depends on the motion alone.

    An elbow bears less than the joints before it, and has to turn harder.
    """
    dynamics = shop.fit.dynamics
    arm, drive = dynamics.arm, dynamics.drive
    safe = Safe(comfortable(arm, acceleration=acceleration), collider(arm, STANDING, 0.02), 0.02)
    path, _ = probe(arm, safe, joint, LEAST, np.random.default_rng(0))
    t = grid(LEAST, RATE)
    motion = Trajectory(t, *path.at(t)).at(t)
    motion = replace(motion, current=dynamics.current(motion))
    follow = dynamics.bristles(motion)
    s = follow.together(drive.presliding_tail)
    seen = rows(space(shop.fit), motion, s, follow.travelled, unfelt(arm.joints))
    test = Backlash(space(shop.fit), 1.0 / RATE, read_rules().fast.joint_backlash)
    state, beat = test.init(), round(BEAT * RATE)
    for k in range(0, len(seen), beat):
        state, _, _ = test.step(
            state,
            seen.part(k, k + beat),
            tool=np.zeros(10),
            ill=np.zeros(arm.joints, dtype=bool),
            swung=np.full((2, arm.joints), np.nan),
            loud=np.zeros((0, 2)),
        )
    row = Observability(test.space, test.rule).of(state)[joint]
    assert row["observable"], row
