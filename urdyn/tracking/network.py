"""The network that a tracked run infers: what moves motor current, and what leads what."""

from __future__ import annotations

from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Edge, Network, Node
from urdyn.errors import InputError
from urdyn.tracking.model import STRAYING

BESIDE = (
    Node("p", "payload"),
    Node("o", "torque offset"),
    Node("I", "rotor inertia"),
    Node("w", "lubricant's warmth"),
)  # parameters of the tracked model that the paper does not have
ORDER = ("k", "p", "m", "I", "beta", "alpha", "f", "z", "o", "w")
SEEN = "curr"  # motion is given, not observed
LEADING = " ".join(STRAYING)


def of_arm(network: Network) -> Network:
    """The network, where each of its edges among parameters leads something in a tracked arm.

    What is observed follows from the physics, whatever edges lead there.

    Raises:
        InputError: a parameter is none of an arm's, or an edge joins one that does not stray.
    """
    strangers = [n.name for n in network.parameters if n.name not in ORDER]
    if strangers:
        told = f"its parameters are {' '.join(ORDER)}"
        raise InputError(f"the arm has no {', '.join(strangers)} to track; {told}")
    inner = {node.name for node in network.parameters}
    for edge in network.edges:
        if {*edge.ends} <= inner and not {*edge.ends} <= set(STRAYING):
            raise InputError(f"{edge} leads nothing: what strays, and may lead, is {LEADING}")
    return network


def tracked_network() -> Network:
    """The paper's parameters, and what else is tracked.

    Of its edges those that the tracked model has: between parameters that stray, and to currents.
    """
    paper = figure2()
    nodes = {node.name: node for node in (*paper.parameters, *BESIDE)}
    kept = [edge for edge in paper.edges if {*edge.ends} <= set(STRAYING)]
    seen = [Edge(name, SEEN) for name in nodes]
    ordered = sorted(nodes.values(), key=lambda node: (*ORDER, node.name).index(node.name))
    return Network((*ordered, paper[SEEN]), (*kept, *seen))
