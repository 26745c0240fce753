"""The paper's Figure 2 as a value: the two-slice dynamic Bayesian network of a robot's twin.

Within a slice every node is linear-Gaussian given its parents,

    x_c = mean_c + sum_p coefficient_pc (x_p - mean_p) + e_c,

and e_c, the part of x_c that is its own, persists from slice to slice while noise moves it. So the
inter-slice edges follow from the others: theta_t -> theta_t+1, and p_t -> c_t+1 wherever p -> c,
because c follows the change of p, whose level is in c_t already. Shared disturbances, `<->`,
correlate e.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from urdyn.dbn.mixed_graph import MixedGraph, Names, Nodes, Pair
from urdyn.errors import InputError
from urdyn.given import as_numbers

Kind = Literal["parameter", "observation"]
Values = float | tuple[float, ...]  # the same for all components of a node, or one for each

CERTAIN = 1.0 + 1e-9  # a learnt correlation may be 1 up to rounding


@dataclass(frozen=True)
class Node:
    """One group of variables, with the distribution of its own part."""

    name: str
    meaning: str = ""
    kind: Kind = "parameter"
    mean: Values = 0.0
    sd: Values = 1.0  # of the first slice's own part: a parameter's prior, a sensor's noise
    diffusion: Values = 0.0  # [unit/√s] diffusion of its own part
    time_constant: Values = float("inf")  # [s] in which its own part is forgotten

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            kinds = " or ".join(get_args(Kind))
            raise InputError(f"{self.name} has the kind {self.kind!r}; take {kinds}")
        fields = (self.mean, self.sd, self.diffusion, self.time_constant)
        mean, sd, diffusion, memory = (as_numbers(values) for values in fields)
        spread = np.r_[sd, diffusion]
        finite = np.isfinite(np.r_[mean, spread]).all()
        if not (finite and (spread >= 0.0).all() and (memory > 0.0).all()):
            raise InputError(
                f"{self.name}: mean, sd and diffusion have to be finite, no sd and no diffusion "
                "below 0, and a time constant above 0"
            )


@dataclass(frozen=True)
class Edge:
    """An arrow within a slice, or a shared disturbance."""

    parent: str
    child: str
    coefficient: float = 1.0  # of an arrow: child per parent; of a shared disturbance: correlation
    shared: bool = False

    def __post_init__(self) -> None:
        if self.parent == self.child:
            raise InputError(f"{self}: an edge joins two nodes")
        if not abs(self.coefficient) < (CERTAIN if self.shared else np.inf):
            raise InputError(
                f"{self} ({self.coefficient}): a coefficient has to be finite, and a shared "
                "disturbance's, a correlation, between -1 and 1"
            )

    @property
    def ends(self) -> Pair:
        """(parent, child)."""
        return self.parent, self.child

    @property
    def joins(self) -> Pair | Names:
        """A key that is unique in a network: the ends, in order for an arrow."""
        return frozenset(self.ends) if self.shared else self.ends

    def __str__(self) -> str:
        return f"{self.parent} {'<->' if self.shared else '->'} {self.child}"


@dataclass(frozen=True)
class Network:
    """Nodes and intra-slice edges; two slices of it make one time step of the twin."""

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]

    def __post_init__(self) -> None:
        _ = self.unrolled  # raises where this makes no graph
        given, seen = Counter(e.joins for e in self.edges), {n.name for n in self.observations}
        for edge in self.edges:
            if given[edge.joins] > 1:
                raise InputError(f"{edge} is there more than once; keep one")
            if edge.parent in seen or (edge.shared and edge.child in seen):
                raise InputError(f"{edge}: what is observed leads nothing, and shares nothing")

    @cached_property
    def parameters(self) -> tuple[Node, ...]:
        """Nodes that persist."""
        return tuple(n for n in self.nodes if n.kind == "parameter")

    @cached_property
    def observations(self) -> tuple[Node, ...]:
        """Nodes that are observed."""
        return tuple(n for n in self.nodes if n.kind == "observation")

    @cached_property
    def slice(self) -> MixedGraph:
        """One slice: its arrows and its shared disturbances."""
        return MixedGraph(
            tuple(n.name for n in self.nodes),
            frozenset(e.ends for e in self.edges if not e.shared),
            frozenset(e.ends for e in self.edges if e.shared),
        )

    @cached_property
    def across(self) -> tuple[Pair, ...]:
        """Inter-slice edges: (parent at t, child at t + 1)."""
        lasting = {n.name for n in self.parameters}
        own = [(n.name, n.name) for n in self.parameters]
        led = [e.ends for e in self.edges if not e.shared and {*e.ends} <= lasting]
        return (*own, *led)

    @cached_property
    def unrolled(self) -> MixedGraph:
        """Slices t and t + 1 as one graph; names of the second are primed."""
        now = self.slice
        arrows = {*now.directed, *((f"{p}'", f"{c}'") for p, c in now.directed)}
        return MixedGraph(
            (*now.nodes, *(f"{n}'" for n in now.nodes)),
            frozenset(arrows | {(p, f"{c}'") for p, c in self.across}),
            now.shared | {(f"{a}'", f"{b}'") for a, b in now.shared},
        )

    def __getitem__(self, name: str) -> Node:
        wanted = self.slice.named(name)
        return next(n for n in self.nodes if n.name in wanted)

    def parents(self, node: str) -> Names:
        """Over both slices: `alpha'` has parents in this slice and the one before."""
        return self.unrolled.parents(node)

    def children(self, node: str) -> Names:
        """Over both slices."""
        return self.unrolled.children(node)

    def markov_blanket(self, node: str) -> Names:
        """Over both slices."""
        return self.unrolled.markov_blanket(node)

    def d_separated(self, a: Nodes, b: Nodes, given: Nodes = (), *more: Nodes) -> bool:
        """Over both slices: whether a and b are independent given all others.

        True is certain. Where it is False, they may yet be independent, by coefficients that belong
        together: p -> c' and c -> c' cancel given p', for the own part of c does not depend on p.
        """
        return self.unrolled.d_separated(a, b, given, *more)

    def hidden(self, observation: str) -> tuple[str, ...]:
        """Parameters without an arrow to an observation.

        Empty where the network has no such observation, and so says nothing of it.
        """
        if observation not in {n.name for n in self.observations}:
            return ()
        seen = self.slice.parents(observation)
        return tuple(n.name for n in self.parameters if n.name not in seen)

    def order(self) -> tuple[str, ...]:
        """Nodes of one slice, each after its parents."""
        return self.slice.order()

    def without(self, parent: str, child: str) -> Network:
        """The network without one edge, and without the inter-slice edge that follows from it.

        The edge is the arrow, or else the shared disturbance, whose ends have no order.
        """
        there = {e.joins: e for e in self.edges}
        gone = there.get((parent, child)) or there.get(frozenset((parent, child)))
        if gone is None:
            told = ", ".join(map(str, self.edges))
            raise InputError(f"no edge joins {parent} to {child}; there are {told}")
        return replace(self, edges=tuple(e for e in self.edges if e is not gone))

    def __str__(self) -> str:
        lines = [f"{n.name:>6}  {n.kind:<11}  {n.meaning}" for n in self.nodes]
        within = [f"{e}  ({e.coefficient:+.3g})" for e in self.edges]
        across = [f"{p}(t) -> {c}(t+1)" for p, c in self.across]
        return "\n".join([*lines, "within a slice", *within, "between slices", *across])
