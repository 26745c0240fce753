"""What a graph says is independent is independent in numbers, and nothing else is."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from urdyn.dbn import MixedGraph
from urdyn.types import Array

NODES = tuple("abcdef")


def random_graph(rng: np.random.Generator) -> MixedGraph:
    """Arrows from earlier to later in a random order, and now and then a shared disturbance."""
    order = rng.permutation(NODES)
    pairs = list(combinations([str(n) for n in order], 2))
    arrows = {p for p in pairs if rng.random() < 0.35}
    return MixedGraph(NODES, frozenset(arrows), frozenset(p for p in pairs if rng.random() < 0.12))


def random_covariance(graph: MixedGraph, rng: np.random.Generator) -> Array:
    """Of a linear model with this graph: coefficients and shared loadings far from zero."""
    at = {n: i for i, n in enumerate(graph.nodes)}
    B, loadings = np.zeros((len(at), len(at))), [np.eye(len(at))]
    for parent, child in graph.directed:
        B[at[child], at[parent]] = rng.choice([-1, 1]) * rng.uniform(0.5, 1.5)
    for ends in graph.shared:
        loading = np.zeros((len(at), 1))
        loading[[at[e] for e in ends], 0] = rng.uniform(0.5, 1.5, 2)
        loadings.append(loading)
    effect = np.linalg.inv(np.eye(len(at)) - B) @ np.hstack(loadings)
    return np.asarray(effect @ effect.T)


def partial_correlation(cov: Array, a: int, b: int, given: list[int]) -> float:
    precision = np.linalg.inv(cov[np.ix_([a, b, *given], [a, b, *given])])
    return float(-precision[0, 1] / np.sqrt(precision[0, 0] * precision[1, 1]))


@pytest.mark.parametrize("seed", range(15))
def test_d_separation_is_conditional_independence(seed: int) -> None:
    """With random coefficients a dependence that the graph allows vanishes with probability 0."""
    rng = np.random.default_rng(seed)
    graph = random_graph(rng)
    cov = random_covariance(graph, rng)
    at = {n: i for i, n in enumerate(NODES)}
    for a, b in combinations(NODES, 2):
        rest = [n for n in NODES if n not in (a, b)]
        for size in range(len(rest) + 1):
            for given in combinations(rest, size):
                strength = abs(partial_correlation(cov, at[a], at[b], [at[g] for g in given]))
                assert graph.d_separated(a, b, given) == (strength < 1e-9), (a, b, given)


@pytest.mark.parametrize("seed", range(15))
def test_a_markov_blanket_shields_and_has_no_member_too_many(seed: int) -> None:
    graph = random_graph(np.random.default_rng(seed))
    for node in NODES:
        blanket = graph.markov_blanket(node)
        outside = set(NODES) - blanket - {node}
        assert graph.d_separated(node, outside, blanket)
        for member in blanket:
            assert not graph.d_separated(node, member, blanket - {member})


def test_every_node_comes_after_its_parents() -> None:
    graph = random_graph(np.random.default_rng(3))
    order = graph.order()
    assert sorted(order) == sorted(NODES)
    assert all(order.index(p) < order.index(c) for p, c in graph.directed)


def test_the_textbook_cases() -> None:
    chain = MixedGraph(("a", "b", "c"), frozenset({("a", "b"), ("b", "c")}))
    collider = MixedGraph(("a", "b", "c"), frozenset({("a", "b"), ("c", "b")}))
    shared = MixedGraph(("a", "b", "c"), frozenset({("a", "b")}), frozenset({("b", "c")}))
    assert chain.d_separated("a", "c", "b") and not chain.d_separated("a", "c")
    assert collider.d_separated("a", "c") and not collider.d_separated("a", "c", "b")
    assert shared.d_separated("a", "c") and not shared.d_separated("a", "c", "b")
