"""The network's parameters, learnt from a tracked history: diffusions, and edges' coefficients.

The currents of each stretch of a history are compressed into one information matrix on the states
that stray, and EM iterates over the stretches: smooth with the current edges, re-estimate the edges
from how the nodes moved. Levels say nothing of motion, so the first level is taken as unknown, and
states that do not stray as known: from the whole history, the payload from its moment. A stretch
must be so short that straying within it is small beside the information in it: else f and alpha,
told apart by moments when the joint is slow and when it is fast, seem to lead one another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from urdyn.dbn.affine import AffineObservation
from urdyn.dbn.compile import compile_linear
from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Network, Node, Values
from urdyn.dbn.joined import Joined
from urdyn.dbn.learn import learn_network
from urdyn.dbn.robot import RobotCurrents
from urdyn.dbn.robot_slice import RobotSlice
from urdyn.dbn.smoothed import Smoothed
from urdyn.errors import InputError
from urdyn.estimate.learn import Learnt, expectation_maximisation
from urdyn.identify.fit import Fit
from urdyn.identify.slow import MEMORY
from urdyn.signal import Sample
from urdyn.tracking.belief.model import Drift, patterns_of, straying
from urdyn.tracking.belief.reading import Reading
from urdyn.tracking.step.tracker import Tracker
from urdyn.types import Array, Gaussian, Index, freeze

STRETCH = 5.0  # [s]
FEW = 3  # stretches, that is two transitions
UNKNOWN = 1.0  # sd of the first level: of a logarithm, of N m, of a standard score
LEAST = 1e-9  # [-] of a stretch's largest information: less is rounding

Moment = tuple[RobotSlice, Array, Array]  # inputs; currents (J,) [A]; states (p,) to linearise at


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of history as a slice of the straying states: y = H x + noise of unit variance."""

    dt: float  # [s]
    H: Array  # (n, n)
    y: Array  # (n,); NaN where there is no information

    def __post_init__(self) -> None:
        freeze(self, "H", "y")


def learn_wear(
    tracker: Tracker[Any],
    history: Callable[[], Iterable[Sample]],
    iterations: int = 50,
    length: float = STRETCH,
) -> Learnt[Network]:
    """The tracker's network with the edges and diffusions that fit a history best.

    Args:
        history: gives its samples, from the beginning; called twice: the second pass takes as
            known what does not stray.
        length: of a stretch [s].
    """
    fit, currents = tracker.fit, tracker.currents
    network = wearing(tracker.network or figure2(), fit, tracker.drift or Drift())
    at = strays(network, currents)
    known = _end(tracker, history())[: len(currents.names)].copy()
    known[currents.places["slow"]] = 0.0
    of_now = np.r_[at, currents.places["payload"]]
    moments = (_moment(reading, known, of_now) for reading in _tracked(tracker, history()))
    stretches = summed_up(moments, currents, known, at, length)
    if len(stretches) < FEW:
        told = f"{len(stretches)} stretches of {length:g} s; edges are learnt from {FEW} and more"
        raise InputError(f"the history has {told}")
    return learn_edges(network, currents, stretches, iterations)


def learn_edges(
    network: Network, currents: RobotCurrents, stretches: Sequence[Stretch], iterations: int
) -> Learnt[Network]:
    """The network fitted best to `stretches`; nodes that do not stray stay as they are."""
    few = _straying_part(network)
    sizes, patterns = sizes_of(few, currents), patterns_of(currents)
    n, dt = sum(sizes.values()), np.array([stretch.dt for stretch in stretches])
    seen: AffineObservation[Stretch] = AffineObservation(n, lambda u: u.H, np.eye(n))

    def build(setting: Network) -> Joined[Stretch]:
        return Joined(compile_linear(setting, sizes, patterns), seen)

    def maximise(setting: Network, history: Smoothed) -> Network:
        return learn_network(setting, sizes, history, dt, patterns)

    observed = np.array([stretch.y for stretch in stretches])
    found = expectation_maximisation(few, build, maximise, stretches, observed, iterations)
    learnt = {node.name: node.diffusion for node in found.setting.parameters}
    coefficients = {edge.joins: edge for edge in found.setting.edges}
    nodes = (replace(n, diffusion=learnt.get(n.name, n.diffusion)) for n in network.nodes)
    edges = (coefficients.get(edge.joins, edge) for edge in network.edges)
    return replace(found, setting=replace(network, nodes=tuple(nodes), edges=tuple(edges)))


def wearing(network: Network, fit: Fit, drift: Drift) -> Network:
    """The network with diffusions from `drift`, and with the drives' offsets added."""
    rates = straying(fit, drift)
    known = any(node.name == "o" for node in network.nodes)
    offsets = () if known else (Node("o", "offsets of the drives"),)
    nodes = (
        replace(node, diffusion=_values(rates.get(node.name, 0.0)))
        for node in (*network.nodes, *offsets)
    )
    return replace(network, nodes=tuple(nodes))


def drift_of(network: Network, fit: Fit, before: Drift | None = None) -> Drift:
    """`before`, updated with the diffusions of a learnt network.

    All joints share one drift: the root mean square.
    """
    before, coulomb = before or Drift(), fit.dynamics.drive.coulomb
    return replace(
        before,
        friction=_typical(network["f"].diffusion),
        damping=_typical(network["alpha"].diffusion),
        structural=_typical(network["beta"].diffusion),
        health=_typical(network["z"].diffusion),
        bodies=_typical(network["m"].diffusion),
        offset=_typical(tuple(np.asarray(network["o"].diffusion) / coulomb)),
    )


def summed_up(
    moments: Iterable[Moment],
    currents: RobotCurrents,
    about: Array,
    at: Index,
    length: float,
) -> list[Stretch]:
    """Stretches of `length` [s], in deviations of straying states, `at` (n,), from `about` (p,)."""
    found, n = [], len(at)
    information, weighted, passed = np.zeros((n, n)), np.zeros(n), 0.0
    for u, y, x in moments:
        if passed and passed + u.dt > length * (1.0 + 1e-9):
            found.append(_stretch(information, weighted, passed))
            information, weighted, passed = np.zeros((n, n)), np.zeros(n), 0.0
        rows = np.isfinite(y)
        expected, H = currents.linearised(x, u)
        H = H[rows][:, at]
        seen = (y - expected)[rows] + H @ (x - about)[at]
        R = (u.variance + _slow(u))[rows]
        information += (H / R[:, None]).T @ H
        weighted += H.T @ (seen / R)
        passed += u.dt
    return [*found, _stretch(information, weighted, passed)] if passed else found


def strays(network: Network, currents: RobotCurrents) -> Index:
    """Indices of the states of the straying nodes, in the network's order, (n,)."""
    groups = [node.name for node in _straying_part(network).parameters]
    return np.concatenate([np.r_[currents.places[group]] for group in groups])


def sizes_of(network: Network, currents: RobotCurrents) -> Mapping[str, int]:
    """Number of components of each parameter."""
    at = currents.places
    return {n.name: at[n.name].stop - at[n.name].start for n in network.parameters}


def _straying_part(network: Network) -> Network:
    """The straying nodes, of unknown first level, and the edges among them."""
    few = [n for n in network.parameters if np.any(np.asarray(n.diffusion) > 0.0)]
    names = {node.name for node in few}
    return Network(
        tuple(replace(node, sd=UNKNOWN, mean=0.0) for node in few),
        tuple(edge for edge in network.edges if {*edge.ends} <= names),
    )


def _stretch(information: Array, weighted: Array, dt: float) -> Stretch:
    value, vector = np.linalg.eigh(information)
    told = value > LEAST * max(float(value[-1]), LEAST)
    root = np.sqrt(np.where(told, value, 1.0))
    y = np.where(told, vector.T @ weighted / root, np.nan)
    return Stretch(dt, np.where(told, root, 0.0)[:, None] * vector.T, y)


def _slow(u: RobotSlice) -> Array | float:
    """Variance of white noise that averages out as slowly as the slow noise, (J,) [A²]."""
    if u.stray is None or not u.dt:
        return 0.0
    return np.asarray((u.stray * u.one) ** 2 * max(1.0, 2.0 * MEMORY / u.dt))


def _tracked(tracker: Tracker[Any], history: Iterable[Sample]) -> Iterator[Reading]:
    state = tracker.init()
    for sample in history:
        state, reading = tracker.step(state, sample)
        if reading is not None:
            yield reading


def _end(tracker: Tracker[Any], history: Iterable[Sample]) -> Array:
    """Mean of all states at a history's end."""
    state = tracker.init()
    for sample in history:
        state, _ = tracker.step(state, sample)
    belief: Gaussian = tracker.filter.belief(state.belief)
    return belief.mean


def _moment(reading: Reading, known: Array, of_now: Index) -> Moment:
    """What a reading learnt from, linearised about its belief in `of_now` and `known` elsewhere."""
    assert reading.learnt is not None, "a tracker's reading"
    x = known.copy()
    x[of_now] = reading.belief.mean[of_now]
    return (*reading.learnt, x)


def _values(rate: float | Array) -> Values:
    return tuple(float(x) for x in rate) if isinstance(rate, np.ndarray) else float(rate)


def _typical(values: Values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
