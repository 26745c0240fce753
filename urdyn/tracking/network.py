"""The network that a tracked run infers: what moves motor current, and what leads what."""

from __future__ import annotations

from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Edge, Network, Node
from urdyn.tracking.model import STRAYING

BESIDE = (
    Node("p", "payload"),
    Node("o", "torque offset"),
    Node("I", "rotor inertia"),
    Node("w", "lubricant's warmth"),
)  # parameters of the tracked model that the paper does not have
ORDER = ("k", "p", "m", "I", "beta", "alpha", "f", "z", "o", "w")
SEEN = "curr"  # motion is given, not observed


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
