"""Positions of a drawn network's nodes: observations outside, parameters inside.

So edges between the slices cross nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from math import hypot

from urdyn.dbn.graph import Network
from urdyn.dbn.mixed_graph import Pair

WIDTH, ROW, TOP, RADIUS = 1000, 84, 70, 24  # [px]
OBSERVED, INSIDE = 110, 360  # [px] columns of the first slice; the second mirrors them
BOX, GAP = (140, 46), 3.0  # [px]; GAP: from a node to an edge's end
EXACT_ORDER = 8  # nodes up to which all orders of the column are tried


@dataclass(frozen=True)
class Place:
    """Where a node of one slice stands."""

    x: float  # [px]
    y: float  # [px]
    half: tuple[float, float] = (0.0, 0.0)  # [px] half width and height of its box
    round: bool = True

    def port(self, other: Place) -> tuple[float, float]:
        """Where an edge to another node leaves: a circle anywhere, a box from its side."""
        dx, dy = other.x - self.x, other.y - self.y
        if self.round:
            reach = (self.half[0] + GAP) / hypot(dx, dy)
            return self.x + reach * dx, self.y + reach * dy
        low, high = -0.8 * self.half[1], 0.8 * self.half[1]
        side = self.half[0] + GAP
        return self.x + (side if dx > 0 else -side), self.y + min(max(0.06 * dy, low), high)


@dataclass(frozen=True)
class Layout:
    """Both slices."""

    now: dict[str, Place]
    then: dict[str, Place]
    height: float  # [px] down to the last row


def layout(network: Network) -> Layout:
    """Positions, with columns ordered so that joined nodes are close."""
    parameters = _column(network)
    seen = _beside(network, parameters)
    height = ROW * max(len(parameters), len(seen))
    now = _stacked(parameters, INSIDE, height, (RADIUS, RADIUS), True)
    now |= _stacked(seen, OBSERVED, height, (BOX[0] / 2, BOX[1] / 2), False)
    then = {name: Place(WIDTH - p.x, p.y, p.half, p.round) for name, p in now.items()}
    return Layout(now, then, TOP + height)


def _column(network: Network) -> list[str]:
    """Parameters from top to bottom."""
    names = [n.name for n in network.parameters]
    joined = [e.ends for e in network.edges if {*e.ends} <= set(names)]
    if not joined or len(names) > EXACT_ORDER:
        return names
    return list(min(permutations(names), key=lambda order: _length(tuple(order), joined)))


def _length(order: tuple[str, ...], joined: list[Pair]) -> int:
    """Squared lengths of all edges, in rows."""
    return sum((order.index(a) - order.index(b)) ** 2 for a, b in joined)


def _beside(network: Network, parameters: list[str]) -> list[str]:
    """Observations, each about level with its parents."""

    def height(name: str) -> float:
        parents = network.slice.parents(name)
        return sum(map(parameters.index, parents)) / max(len(parents), 1)

    return sorted((n.name for n in network.observations), key=height)


def _stacked(
    names: list[str], x: float, height: float, half: tuple[float, float], round_: bool
) -> dict[str, Place]:
    pitch = height / max(len(names), 1)
    return {name: Place(x, TOP + (i + 0.5) * pitch, half, round_) for i, name in enumerate(names)}
