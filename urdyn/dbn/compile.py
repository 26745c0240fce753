"""From a network to the state-space model that every filter runs.

With B the coefficients of the arrows among parameters, M = (1 - B)⁻¹, D(t) the covariance of the
own parts (shared disturbances off its diagonal) and K = exp(-dt / tau) the share that persists,

    P0 = M D0 Mᵀ,    F = M K (1 - B),    Q = M Dq(dt) Mᵀ.

Without an arrow its entry of B is zero, and data on the parent no longer move the child.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral

import numpy as np

from urdyn.dbn.graph import CERTAIN, Network, Node
from urdyn.dbn.mixed_graph import Pair
from urdyn.dbn.stacking import stacked
from urdyn.dbn.two_slice import Slice
from urdyn.errors import InputError
from urdyn.types import Array, Gaussian, Mask, freeze

Patterns = Mapping[Pair, Array]  # (child's size, parent's size) by ends; identity where not named


@dataclass(frozen=True, eq=False)
class CompiledNetwork:
    """The parameters of a network as a `Process`."""

    names: tuple[str, ...]  # n, "f_0", "f_1", ...
    mean: Array  # (n,)
    B: Array  # (n, n) coefficients of the arrows, child by parent
    own: Array  # (n, n) D0, first slice's own parts
    disturbance: Array  # (n, n) [1/s] process noise of the own parts
    time_constant: Array  # (n,) [s]

    def __post_init__(self) -> None:
        freeze(self, "mean", "B", "own", "disturbance", "time_constant")

    @cached_property
    def spread(self) -> Array:
        """M = (1 - B)⁻¹: effect of a change of each own part on every state, (n, n)."""
        return np.asarray(np.linalg.inv(np.eye(len(self.names)) - self.B))

    @cached_property
    def prior(self) -> Gaussian:
        """First slice, (n,), (n, n)."""
        return Gaussian(self.mean, self.spread @ self.own @ self.spread.T)

    @cached_property
    def linear(self) -> Mask:
        """All states, (n,)."""
        return np.ones(len(self.names), dtype=bool)

    def transition(self, x: Array, u: Slice) -> Array:
        """Own parts persist, (..., n)."""
        return np.asarray(self.mean + (x - self.mean) @ self.transition_jacobian(x, u).T)

    def transition_jacobian(self, x: Array, u: Slice) -> Array:
        """F, (n, n)."""
        kept = np.exp(-u.dt / self.time_constant)
        return np.asarray(self.spread * kept @ (np.eye(len(kept)) - self.B))

    def transition_cov(self, u: Slice) -> Array:
        """Q, (n, n)."""
        forgotten = 1.0 / self.time_constant
        rate = forgotten[:, None] + forgotten
        # (1 - exp(-rate dt)) / rate, which is dt at rate 0.
        gathered = np.full_like(rate, u.dt)
        np.divide(-np.expm1(-rate * u.dt), rate, out=gathered, where=rate > 0.0)
        return np.asarray(self.spread @ (self.disturbance * gathered) @ self.spread.T)


def compile_linear(
    network: Network, sizes: Mapping[str, int], patterns: Patterns | None = None
) -> CompiledNetwork:
    """The parameters of `network`, each node with as many components as `sizes` says.

    Raises:
        InputError: a node has no size, or values of another; a pattern is missing or of another
            shape; shared disturbances contradict one another.
    """
    at, led = places(network, sizes), patterns or {}
    n = max(place.stop for place in at.values())
    correlation = correlations(network, at, led, n)
    sd, diffusion = (_stack(network, sizes, field) for field in ("sd", "diffusion"))
    return CompiledNetwork(
        tuple(f"{name}_{i}" for name in at for i in range(sizes[name])),
        _stack(network, sizes, "mean"),
        coefficients(network, at, led, n),
        correlation * np.outer(sd, sd),
        correlation * np.outer(diffusion, diffusion),
        _stack(network, sizes, "time_constant"),
    )


def places(network: Network, sizes: Mapping[str, int]) -> dict[str, slice]:
    """Place of each parameter node in the compiled state; InputError where one has no size."""
    if not network.parameters:
        raise InputError("the network has no parameters, and compiles to nothing")
    for node in network.parameters:
        size = sizes.get(node.name)
        if not isinstance(size, Integral) or size < 0:
            raise InputError(f"{node.name} has no size of 0 or more; sizes are {dict(sizes)}")
    return stacked({node.name: sizes[node.name] for node in network.parameters})


def pattern(edge: Pair, at: Mapping[str, slice], patterns: Patterns) -> Array:
    """Which components of the parent lead which of the child, (child's size, parent's size)."""
    parent, child = (at[name].stop - at[name].start for name in edge)
    if edge in patterns:
        given = np.asarray(patterns[edge], dtype=float)
        if given.shape != (child, parent):
            raise InputError(
                f"the pattern for {edge} has the shape {given.shape}; "
                f"child by parent it is {(child, parent)}"
            )
        return given
    if parent != child:
        raise InputError(
            f"{edge[0]} has {parent} components and {edge[1]} has {child}; "
            f"say by a pattern for {edge} which lead which"
        )
    return np.eye(parent)


def coefficients(network: Network, at: Mapping[str, slice], patterns: Patterns, n: int) -> Array:
    """B of the arrows between the nodes with places `at` in the state, (n, n)."""
    B = np.zeros((n, n))
    for edge in network.edges:
        if not edge.shared and {*edge.ends} <= set(at):
            block = edge.coefficient * pattern(edge.ends, at, patterns)
            B[at[edge.child], at[edge.parent]] = block
    return B


def correlations(network: Network, at: Mapping[str, slice], patterns: Patterns, n: int) -> Array:
    """Correlations of those nodes' own parts, (n, n); InputError where they are impossible."""
    shared = [edge for edge in network.edges if edge.shared and {*edge.ends} <= set(at)]
    correlation = np.eye(n)
    for edge in shared:
        block = edge.coefficient * pattern(edge.ends, at, patterns)
        correlation[at[edge.child], at[edge.parent]] = block
        correlation[at[edge.parent], at[edge.child]] = block.T
    least = np.linalg.eigvalsh(correlation).min(initial=0.0)
    if least < (1.0 - CERTAIN) * len(correlation):
        told = ", ".join(f"{edge} ({edge.coefficient:+.3g})" for edge in shared)
        raise InputError(f"no variables are correlated like this: {told}; bring them nearer to 0")
    return correlation


def _stack(network: Network, sizes: Mapping[str, int], field: str) -> Array:
    """One field of all parameter nodes, component by component, (n,)."""
    return np.concatenate([_spread(n, field, sizes[n.name]) for n in network.parameters])


def _spread(node: Node, field: str, size: int) -> Array:
    values = np.atleast_1d(np.asarray(getattr(node, field), dtype=float))
    if values.shape not in ((1,), (size,)):
        raise InputError(f"{node.name} has {size} components, and of {field} {len(values)} values")
    return np.array(np.broadcast_to(values, (size,)))
