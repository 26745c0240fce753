"""Graphs of arrows and shared disturbances, and the independences that they imply.

`a -> b`: b's distribution is conditional on a. `a <-> b`: a latent variable disturbs both.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError, TopologicalSorter

from urdyn.errors import InputError

Pair = tuple[str, str]
Names = frozenset[str]
Nodes = str | Iterable[str]  # one, or more


@dataclass(frozen=True)
class MixedGraph:
    """Acyclic directed edges, and bidirected ones."""

    nodes: tuple[str, ...]
    directed: frozenset[Pair]  # (parent, child)
    shared: frozenset[Pair] = frozenset()  # (a, b), in either order

    def __post_init__(self) -> None:
        if twice := sorted({n for n in self.nodes if self.nodes.count(n) > 1}):
            raise InputError(f"two nodes are named {', '.join(twice)}; give each its own name")
        self.named(end for pair in self.directed | self.shared for end in pair)
        try:
            self.order()
        except CycleError as error:
            circle = " -> ".join(error.args[1])
            raise InputError(f"arrows lead in a circle, {circle}; take one out") from None

    def named(self, nodes: Nodes) -> Names:
        """One or more nodes as a set; InputError where the graph lacks one."""
        found = (nodes,) if isinstance(nodes, str) else tuple(nodes)
        if strange := sorted(str(n) for n in found if n not in self.nodes):
            raise InputError(f"no node {', '.join(strange)}; there are {', '.join(self.nodes)}")
        return frozenset(found)

    def parents(self, *nodes: str) -> Names:
        """Parents of `nodes`."""
        ends = self.named(nodes)
        return frozenset(p for p, c in self.directed if c in ends)

    def children(self, *nodes: str) -> Names:
        """Children of `nodes`."""
        ends = self.named(nodes)
        return frozenset(c for p, c in self.directed if p in ends)

    def ancestors(self, nodes: Iterable[str]) -> Names:
        """`nodes` and all nodes from which arrows lead to them."""
        found = self.named(nodes)
        while not (more := self.parents(*found)) <= found:
            found |= more
        return found

    def order(self) -> tuple[str, ...]:
        """All nodes, each after its parents."""
        sorter = TopologicalSorter({n: sorted(self.parents(n)) for n in self.nodes})
        return tuple(sorter.static_order())

    def district(self, *nodes: str) -> Names:
        """`nodes` and all nodes that shared disturbances connect to them."""
        found = self.named(nodes)
        while not (more := {e for pair in self.shared if found & {*pair} for e in pair}) <= found:
            found |= more
        return found

    def markov_blanket(self, node: str) -> Names:
        """The nodes given which `node` is independent of the rest of the graph."""
        heads = self.district(node, *self.children(node))
        return (heads | self.parents(*heads)) - {node}

    def d_separated(self, a: Nodes, b: Nodes, given: Nodes = (), *more: Nodes) -> bool:
        """Whether a and b are independent given all others in every distribution of this graph.

        They are if every path from a to b in the moral graph of their ancestors meets a given node
        [Lauritzen1990]_; a shared disturbance is a common parent that is never given.
        """
        start, goal = self.named(a), self.named(b)
        known = self.named(given).union(*map(self.named, more))
        plain = self._with_latents
        kept = plain.ancestors(start | goal | known)
        reached, frontier = start - known, start - known
        while frontier:
            frontier = plain._moral_neighbours(frontier, kept) - known - reached
            reached |= frontier
        return not reached & goal

    @cached_property
    def _with_latents(self) -> MixedGraph:
        """A graph with the same independences among `nodes`, with arrows only."""
        latent = {f"{a}<->{b}": (a, b) for a, b in self.shared}
        arrows = {(name, end) for name, ends in latent.items() for end in ends}
        return MixedGraph((*self.nodes, *latent), self.directed | arrows)

    def _moral_neighbours(self, nodes: Names, kept: Names) -> Names:
        """Parents, children and the children's other parents, within `kept`."""
        children = self.children(*nodes) & kept
        return (children | self.parents(*nodes) | self.parents(*children)) & kept
