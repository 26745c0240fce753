"""An arm that does the same work again and again, as one that is never switched off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from urdyn.model.dynamics import Dynamics
from urdyn.simulate.follow import inverse
from urdyn.simulate.heat import typical_heat
from urdyn.simulate.observe import Fidelity, observe
from urdyn.simulate.schedule import Course, Event, befallen
from urdyn.simulate.sensors import Sensors
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.warmth import warm_up
from urdyn.simulate.work import Work
from urdyn.types import Log


@dataclass(frozen=True, eq=False)
class Later:
    """Events that happen `by` later [s] than they say."""

    events: Sequence[Event]
    by: float  # [s]
    onset: float = -np.inf  # [s]: theirs are their own

    def befall(self, course: Course) -> Course:
        """The course of an earlier time."""
        return replace(befallen(replace(course, t=course.t - self.by), self.events), t=course.t)


def rounds(
    dynamics: Dynamics,
    work: Work,
    sensors: Sensors,
    rng: np.random.Generator,
    faults: Sequence[Event] = (),
    heat: bool = False,
    fidelity: Fidelity = inverse,
) -> Iterator[Log]:
    """The second round of work that ends where it began, the third, and so on.

    Behind the log of the first they are the log of all of it in one go: stamps run on, faults
    grow on, joints stay warm, and noise is new, of which only the colour begins anew. Each is
    simulated together with the round before, which leaves friction, gears and loop as it does.
    """
    once, room = work.trajectory, typical_heat(dynamics)
    lasting, warm = len(once) * once.step, room.cold
    twice = Trajectory(
        once.step * np.arange(2.0 * len(once)),
        *(np.concatenate([way, way]) for way in (once.q, once.v, once.a)),
    )
    for turn in count():
        events: tuple[Event, ...] = (Later(faults, -turn * lasting), *work.handling)
        if heat:
            warmth = warm_up(dynamics, once, room, events, warm)
            events, warm = (*events, warmth), warmth.end
        if turn:
            both = observe(dynamics, twice, sensors, rng, (Later(events, lasting),), fidelity)
            log = both.slice(len(once))
            yield replace(log, t=log.t + (turn - 1) * lasting)
