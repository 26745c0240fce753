"""The network that a tracked run infers: what affects motor current, and what leads what."""

from __future__ import annotations

from collections.abc import Iterable

from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Edge, Network, Node
from urdyn.errors import InputError
from urdyn.tracking.belief.model import SEEN, STRAYING

BESIDE = (
    Node("p", "payload"),
    Node("o", "torque offset"),
    Node("I", "rotor inertia"),
    Node("w", "lubricant's warmth"),
)  # parameters of the tracked model that the paper lacks
ORDER = ("k", "p", "m", "I", "beta", "alpha", "f", "z", "o", "w")
# By group that another stream measures too: the nodes whose edges say so, and what is observed.
TOLD_BY = {"k": (("k",), "pos"), "payload": (("m", "p"), "force")}
LEADING = " ".join(STRAYING)


def of_arm(network: Network, shared: Iterable[str] = ()) -> Network:
    """The network, if a tracked arm can have exactly the edges that it states.

    How a parameter affects an observation is physics; without an edge, it does not.
    `shared` are groups that other streams measure.

    Raises:
        InputError: an arm has no such parameter, an edge joins one that does not stray, or an edge
            is missing that an observation depends on.
    """
    _require_known(network)
    _require_edges(network)
    _require_shown(network, shared)
    return network


def _require_known(network: Network) -> None:
    strangers = [n.name for n in network.parameters if n.name not in ORDER]
    if strangers:
        told = f"its parameters are {' '.join(ORDER)}"
        raise InputError(f"the arm has no {', '.join(strangers)} to track; {told}")


def _require_edges(network: Network) -> None:
    """Edges join parameters that stray, or lead to an observation with coefficient 1."""
    inner = {node.name for node in network.parameters}
    for edge in network.edges:
        if {*edge.ends} <= inner and not {*edge.ends} <= set(STRAYING):
            raise InputError(f"{edge} leads nothing: what strays, and may lead, is {LEADING}")
        if edge.child not in inner and edge.coefficient != 1.0:
            raise InputError(
                f"{edge} ({edge.coefficient:+.3g}): what shows there follows from physics; leave "
                "the coefficient at 1, or take the edge out"
            )


def _require_shown(network: Network, shared: Iterable[str]) -> None:
    """The payload must show in currents, and shared groups in the streams that measure them."""
    if "p" in network.hidden(SEEN):
        raise InputError(f"p -> {SEEN} is missing: it tells what an arm carries; put it back")
    inner = {node.name for node in network.parameters}
    for parents, seen in (TOLD_BY[group] for group in shared if group in TOLD_BY):
        known = [p for p in parents if p in inner]
        if known and set(known) <= set(network.hidden(seen)):
            told = " or ".join(f"{p} -> {seen}" for p in known)
            raise InputError(f"{told} is missing, and a stream tells by it; leave out that stream")


def tracked_network() -> Network:
    """The paper's parameters and the other tracked ones.

    Its edges are the tracked ones of the paper: between parameters that stray, and to currents.
    """
    paper = figure2()
    nodes = {node.name: node for node in (*paper.parameters, *BESIDE)}
    kept = [edge for edge in paper.edges if {*edge.ends} <= set(STRAYING)]
    seen = [Edge(name, SEEN) for name in nodes]
    ordered = sorted(nodes.values(), key=lambda node: (*ORDER, node.name).index(node.name))
    return Network((*ordered, paper[SEEN]), (*kept, *seen))
