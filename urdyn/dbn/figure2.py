"""The network of the paper's Figure 2, with the observations that each parameter affects here.

`pos`, `curr` and `force` are streams of their own, each used when it arrives. `vel` is not: joint
velocities only help to estimate the motion, where values inconsistent with the angles are refused;
they say nothing of any parameter, as they are the encoders' angles over time. A tool's velocity
depends on k as its pose does, times the joints' speed: at 1 rad/s and noise of 2e-3 rad/s its
information on k is some 2500 times less than that of a pose good to 20 um. Nor does a wrench depend
on k here: it is that of the payload, beyond the links.
"""

from __future__ import annotations

from urdyn.dbn.graph import Edge, Network, Node

PARAMETERS = (
    Node("k", "kinematic offsets"),
    Node("m", "link inertials"),
    Node("f", "Coulomb friction"),
    Node("alpha", "viscous damping"),
    Node("beta", "structural damping"),
    Node("z", "drive health"),
)
OBSERVATIONS = (
    Node("pos", "pose of the tool", "observation"),
    Node("vel", "velocity of the tool", "observation"),
    Node("curr", "joint currents", "observation"),
    Node("force", "wrench at the flange", "observation"),
)
# Worn or cold gears raise both kinds of friction; a heavier link loads the bearing that damps it.
# In logarithms, and prior to data: learning the network replaces these. Masses of a tracked arm
# stray, and so lead, only where its `Drift.bodies` says so.
FRICTION_TO_DAMPING = 0.5
MASS_TO_DAMPING = 0.1
FRICTION_WITH_HEALTH = -0.3  # what wears a gear weakens its drive
SEEN_BY = {
    "k": ("pos", "vel", "curr", "force"),
    "m": ("curr", "force"),
    "f": ("curr",),
    "alpha": ("curr",),
    "beta": ("curr",),
    "z": ("curr",),
}


def figure2() -> Network:
    """k, m, f, alpha, beta, z and the observations that they affect, in standard units."""
    between = (
        Edge("f", "alpha", FRICTION_TO_DAMPING),
        Edge("m", "alpha", MASS_TO_DAMPING),
        Edge("f", "z", FRICTION_WITH_HEALTH, shared=True),
    )
    seen = tuple(Edge(p, o) for p, observations in SEEN_BY.items() for o in observations)
    return Network((*PARAMETERS, *OBSERVATIONS), (*between, *seen))
