"""Coefficients and noise of a network from tracked history: the M step of EM.

The E step is a smoother's `Smoothed`. Every formula is least squares on expected second moments;
without the smoother's covariances, noise would be underestimated and coefficients biased toward
zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from urdyn.dbn.compile import Patterns, places
from urdyn.dbn.graph import Network, Node
from urdyn.dbn.movements import Movements
from urdyn.dbn.smoothed import Smoothed
from urdyn.errors import InputError
from urdyn.types import Array, Mask, frozen


def learn_diffusion(residuals: Array, dt: Array) -> Array:
    """Diffusion per square root of a second, (n,), from process residuals (N, n, n).

    Slices in which no time passes are left out; InputError where there are no others.
    """
    dt = frozen(dt)
    passed = _passed(dt, len(residuals))
    variances = np.diagonal(residuals[passed], axis1=1, axis2=2) / dt[passed, None]
    return np.asarray(np.sqrt(variances.mean(axis=0)))


def learn_measurement_noise(residuals: Array) -> Array:
    """Noise variance of each sensor over the slices where it was measured, (m,), from (N, m, m).

    InputError where one never was.
    """
    squares = np.diagonal(residuals, axis1=1, axis2=2)
    silent = np.flatnonzero(np.isnan(squares).all(axis=0))
    if len(silent):
        raise InputError(f"sensor {', '.join(map(str, silent))} never spoke; leave it out")
    return np.asarray(np.nanmean(squares, axis=0))


def learn_network(
    network: Network,
    sizes: Mapping[str, int],
    history: Smoothed,
    dt: Array,
    patterns: Patterns | None = None,
) -> Network:
    """The network with coefficients, diffusions and shared correlations fitted to a history.

    They are estimated from the nodes' movements over steps `dt` [s], (N,), assuming that own parts
    are not forgotten meanwhile. One coefficient serves all components of an edge.

    Raises:
        InputError: the history is of other states or slices, or time passes in none of these.
    """
    at, led, dt = places(network, sizes), patterns or {}, frozen(dt)
    states = sum(sizes[name] for name in at)
    if history.mean.shape[1] != states:
        raise InputError(f"the history has {history.mean.shape[1]} states, the network {states}")
    passed = _passed(dt, len(history.cross))
    moved = (history.increments()[passed] / dt[passed, None, None]).mean(axis=0)
    inner = [edge for edge in network.edges if {*edge.ends} <= set(at)]
    arrows, shared, own = Movements(moved, int(passed.sum()), at, led).likeliest(
        [edge for edge in inner if not edge.shared], [edge for edge in inner if edge.shared]
    )
    learnt = {edge.joins: edge for edge in (*arrows, *shared)}
    return Network(
        tuple(_diffusing(n, own, at) if n.name in at else n for n in network.nodes),
        tuple(learnt.get(edge.joins, edge) for edge in network.edges),
    )


def _passed(dt: Array, slices: int) -> Mask:
    """Slices in which time passes, (N,); InputError where there are none."""
    if np.shape(dt) != (slices,):
        raise InputError(f"dt has the shape {np.shape(dt)}; there are {slices} slices")
    passed = dt > 0.0
    if not passed.any():
        raise InputError("dt is above 0 in no slice; while no time passes nothing tells what moves")
    return passed


def _diffusing(node: Node, own: Array, at: Mapping[str, slice]) -> Node:
    """A node with the diffusion of its own part, component by component."""
    variances = np.diag(own)[at[node.name]]
    return replace(node, diffusion=tuple(float(s) for s in np.sqrt(variances)))
