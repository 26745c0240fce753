"""The probe of a joint shows a gap in its gear, by the criterion that later judges the motion."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from shop import Shop
from typer.main import get_command

from urdyn.cli.app import app
from urdyn.cli.excite import _joint
from urdyn.diagnose.fast.backlash import Backlash
from urdyn.diagnose.fast.observability import Observability
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.pace import BEAT
from urdyn.diagnose.residual.rows import rows
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.residual.warmth import unfelt
from urdyn.identify.excite.probe import LEAST, probe
from urdyn.identify.excite.proof import Safe
from urdyn.model.arm import Arm, read_arm
from urdyn.model.cell import STANDING
from urdyn.model.collision import collider
from urdyn.simulate import Payload, Trajectory
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


@pytest.mark.parametrize(("mass", "light"), [(0.0, [3, 4, 5]), (5.0, [])])
def test_the_probe_is_proposed_unless_a_joint_bears_too_little_to_show_a_gap(
    shop: Shop, mass: float, light: list[int]
) -> None:
    """As the command line takes it. A load out of its axis makes a wrist bear enough."""
    payload = Payload(mass, np.array([0.1, 0.0, 0.1])).inertials() if mass else np.zeros(10)
    of = space(shop.fit)
    of = replace(of, reference=replace(of.reference, payload=payload))
    test = Backlash(of, 1.0 / RATE, read_rules().fast.joint_backlash)
    told = [row["probe"] for row in Observability(of, test.rule).of(test.init())]
    arm, asked = of.reference.arm, "urdyn excite --kind probe --joint "
    names = [re.search(asked + r"(\w+)", text)[1] for text in told]
    assert [_joint(arm, name, "probe") for name in names] == list(range(arm.joints))
    known = {option for each in get_command(app).commands["excite"].params for option in each.opts}
    assert {option for text in told for option in re.findall(r"--[a-z-]+", text)} < known
    assert [j for j, text in enumerate(told) if "no motion" in text] == light


def test_of_a_joint_that_was_not_learnt_no_motion_shows_a_gap(shop: Shop) -> None:
    of = replace(space(shop.fit), unlearnt=np.arange(6) == 2)
    test = Backlash(of, 1.0 / RATE, read_rules().fast.joint_backlash)
    told = [row["probe"] for row in Observability(of, test.rule).of(test.init())]
    assert ["commission anew" in text for text in told] == list(of.unlearnt)


def test_a_probe_is_of_a_joint_by_its_name_however_that_is_written(ur5e: Arm) -> None:
    arm = read_arm(ur5e.urdf.replace("shoulder_lift_joint", "Joint2"), "its.urdf")
    assert {_joint(arm, name, "probe") for name in ("Joint2", "joint2", "JOINT2")} == {1}
