"""The network that a tracked run infers: what moves motor current, and what leads what."""

from __future__ import annotations

from collections.abc import Iterable

from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Edge, Network, Node
from urdyn.errors import InputError
from urdyn.tracking.model import SEEN, STRAYING

BESIDE = (
    Node("p", "payload"),
    Node("o", "torque offset"),
    Node("I", "rotor inertia"),
    Node("w", "lubricant's warmth"),
)  # parameters of the tracked model that the paper does not have
ORDER = ("k", "p", "m", "I", "beta", "alpha", "f", "z", "o", "w")
# By the group that another stream tells of too: whose edges say so, and to what is observed there.
TOLD_BY = {"k": (("k",), "pos"), "payload": (("m", "p"), "force")}
LEADING = " ".join(STRAYING)


def of_arm(network: Network, shared: Iterable[str] = ()) -> Network:
    """The network, where all that its edges say, and their lack, is so in a tracked arm.

    What a parameter does to what is observed is physics; where no edge leads there, nothing.
    `shared` are groups that other streams tell of.

    Raises:
        InputError: a parameter is none of an arm's, an edge joins one that does not stray, or one
            is missing by which something is told.
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
    """Between parameters that stray, and to what is observed without a coefficient."""
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
    """The payload in currents, and what other streams tell of in these."""
    if "p" in network.hidden(SEEN):
        raise InputError(f"p -> {SEEN} is missing: it tells what an arm carries; put it back")
    inner = {node.name for node in network.parameters}
    for parents, seen in (TOLD_BY[group] for group in shared if group in TOLD_BY):
        known = [p for p in parents if p in inner]
        if known and set(known) <= set(network.hidden(seen)):
            told = " or ".join(f"{p} -> {seen}" for p in known)
            raise InputError(f"{told} is missing, and a stream tells by it; leave out that stream")


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
