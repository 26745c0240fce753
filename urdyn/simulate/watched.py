"""What a laser tracker beside a virtual arm measures while it works."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from urdyn.model.dynamics import Dynamics
from urdyn.simulate.recorder import fresh
from urdyn.types import Array, Log

PLACE_NOISE, TURN_NOISE = 2e-5, 5e-5  # [m], [rad] sd of each coordinate
FAR = 3.0  # [m] from the arm to the tracker
TARGET = 0.1  # [m] from the flange


def watched(
    dynamics: Dynamics, t: Array, links: Array, rate: float, rng: np.random.Generator
) -> Log:
    """Poses of a target on the flange, in the tracker's frame, at `rate` [Hz] and the log's clock.

    The tracker sees the true `links` (N, J) [rad] at t (N,), not the encoders' readings.
    """
    rows = fresh(t, rate)
    t, arm = t[rows], dynamics.arm
    seen = _frame(rng, FAR) @ arm.pose(links[rows], arm.link_names[-1]) @ _frame(rng, TARGET)
    place = seen[:, :3, 3] + PLACE_NOISE * rng.standard_normal((len(t), 3))
    jitter = Rotation.from_rotvec(TURN_NOISE * rng.standard_normal((len(t), 3)))
    angles = (jitter * Rotation.from_matrix(seen[:, :3, :3])).as_rotvec()
    values = np.hstack([place, angles]).T
    return Log(t, dict(zip(("x", "y", "z", "rx", "ry", "rz"), values, strict=True)))


def _frame(rng: np.random.Generator, far: float) -> Array:
    """A randomly turned frame about `far` [m] away."""
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_rotvec(rng.uniform(-1.5, 1.5, 3)).as_matrix()
    way = rng.standard_normal(3)
    frame[:3, 3] = far * way / np.linalg.norm(way)
    return frame
