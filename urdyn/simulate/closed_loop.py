"""The closed loop: a controller at its own rate, the arm in between, events on schedule.

The forward fidelity. It follows the same course as the inverse one, tick by tick.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.simulate.controller import Controller
from urdyn.simulate.plant import Gears, Plant, PlantState, Surroundings
from urdyn.simulate.rigid import pushed
from urdyn.simulate.schedule import Course
from urdyn.simulate.trajectory import Trajectory
from urdyn.types import Array

RIGID_STEP = 1e-3  # [s] at most
ELASTIC_STEP = 1e-4  # [s] at most: a bare wrist 3 on its gear rings at some 600 Hz
LONGEST_DELAY = 64  # ticks of loop delay, at most


@dataclass(frozen=True, eq=False)
class Tick:
    """One tick of the controller."""

    state: PlantState
    current: Array  # (J,) [A] in the motors


def closed_loop(
    dynamics: Dynamics,
    controller: Controller,
    targets: Trajectory,
    ahead: Array,
    course: Course,
    gears: Gears | None,
) -> Iterator[Tick]:
    """The arm following `targets`; it starts at rest on their first row, its gears wound.

    Args:
        targets: one row per tick of the controller.
        ahead: feed-forward torque, (N, J) [N·m].
        course: at the same rows.
        gears: elasticity of the gears; None: rigid.
    """
    period = targets.step
    substeps = int(np.ceil(period / (ELASTIC_STEP if gears else RIGID_STEP) - 1e-9))
    plant = Plant(replace(dynamics, payload=course.payload[0]), gears)
    x = plant.rest(targets.q[0], course.half_gap[0])
    past = deque([x], maxlen=LONGEST_DELAY)
    total = np.zeros(targets.joints)
    for k in range(len(targets)):
        if not np.array_equal(course.payload[k], plant.dynamics.payload):
            plant = Plant(replace(dynamics, payload=course.payload[k]), gears)
        seen = past[-1 - min(round(course.loop_delay[k] / period), len(past) - 1)]
        e = targets.q[k] - seen.theta - course.encoder_offset[k]
        total = total + period * e
        asked = controller.torque(
            ahead[k], e, targets.v[k] - seen.omega, total, course.loop_gain[k]
        )
        current = asked / controller.gain
        yield Tick(x, current)
        torque = current * dynamics.drive.gain * course.health[k]
        around = _around(dynamics, course, k, x)
        for _ in range(substeps):
            x = plant.step(x, torque, around, period / substeps)
        past.append(x)


def _around(dynamics: Dynamics, course: Course, k: int, x: PlantState) -> Surroundings:
    push = course.push[k : k + 1]
    torque = pushed(dynamics.arm, x.q[None], push)[0] if push.any() else np.zeros_like(x.q)
    return Surroundings(
        torque=torque,
        coulomb=course.coulomb[k],
        viscous=course.viscous[k],
        gap=course.half_gap[k],
        temperature=course.temperature[k],
    )
