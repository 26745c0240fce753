"""There and back: work that ends where it began, so that it can be repeated.

A feasible motion is feasible in reverse. In q(-t), velocities change their sign and accelerations
do not; M(q) a + C(q, v) v + g(q) is the same torque. What was picked up on the way there is put
back on the way back.
"""

from __future__ import annotations

import numpy as np

from urdyn.simulate.schedule import Handling
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.work import Work


def there_and_back(work: Work) -> Work:
    """The work and then its reverse; the work alone where it ends as it began."""
    there = work.trajectory
    in_hand = any(done.carried[-1].any() for done in work.handling)
    if np.allclose(there.q[-1], there.q[0]) and not in_hand:
        return work
    end = 2.0 * there.t[-1]
    t = np.concatenate([there.t, end - there.t[-2::-1]])
    q, v, a = (
        np.concatenate([way, sign * way[-2::-1]])
        for way, sign in ((there.q, 1.0), (there.v, -1.0), (there.a, 1.0))
    )
    return Work(Trajectory(t, q, v, a), tuple(_put_back(done, end) for done in work.handling))


def _put_back(done: Handling, end: float) -> Handling:
    """The handling, followed until `end` [s] by its reverse, which undoes it."""
    before = np.vstack([np.zeros(10), done.carried[:-1]])
    return Handling(
        np.concatenate([done.begin, end - done.begin[::-1]]),
        np.concatenate([done.carried, before[::-1]]),
    )
