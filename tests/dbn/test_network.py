"""The paper's Figure 2 as a value, and what it compiles to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from urdyn.dbn import (
    AffineObservation,
    Edge,
    Joined,
    MixedGraph,
    Network,
    Node,
    Tick,
    compile_linear,
    figure2,
    places,
)
from urdyn.errors import InputError
from urdyn.estimate import Kalman, track
from urdyn.types import Array

A, B, SEEN = Node("a"), Node("b"), Node("y", kind="observation")
ONE_EACH = {n.name: 1 for n in figure2().parameters}


def wandering(network: Network) -> Network:
    """The same network with every parameter adrift."""
    nodes = (replace(n, diffusion=0.1) if n.kind == "parameter" else n for n in network.nodes)
    return replace(network, nodes=tuple(nodes))


def test_figure_2_has_the_papers_edges() -> None:
    network = figure2()
    assert [n.name for n in network.parameters] == ["k", "m", "f", "alpha", "beta", "z"]
    assert [n.name for n in network.observations] == ["pos", "vel", "curr", "force"]
    assert network.parents("alpha") == {"f", "m"}
    assert network.slice.shared == {("f", "z")}
    assert network.parents("curr") == {"k", "m", "f", "alpha", "beta", "z"}
    assert network.parents("beta'") == {"beta"}
    assert network.parents("alpha'") == {"alpha", "f", "m", "f'", "m'"}
    assert network.markov_blanket("beta'") == {"beta", "curr'", "k'", "m'", "f'", "alpha'", "z'"}


def test_figure_2_answers_questions_of_independence() -> None:
    network = figure2()
    assert network.d_separated("k", "f")
    assert not network.d_separated("k", "f", "curr")  # both move the current
    assert not network.d_separated("f", "z")  # what wears one wears the other
    assert network.d_separated("m", "z")
    assert network.d_separated("beta", "beta'", "z") is False
    assert network.order().index("alpha") > network.order().index("f")


@pytest.mark.parametrize("graph", [figure2(), figure2().slice], ids=["network", "graph"])
@pytest.mark.parametrize("given", ["curr", ["curr"], ("curr",), {"curr"}])
def test_what_is_known_is_given_as_one_name_or_more(
    graph: Network | MixedGraph, given: str | Iterable[str]
) -> None:
    assert graph.d_separated("k", "f") and graph.d_separated({"k"}, ["f", "m"], ())
    assert not graph.d_separated("k", "f", given)
    assert not graph.d_separated("k", "f", given=given)
    assert not graph.d_separated({"k"}, {"f"}, given)


def test_all_that_is_known_counts() -> None:
    ways = frozenset({("a", "b"), ("b", "d"), ("a", "c"), ("c", "d")})
    graph = MixedGraph(("a", "b", "c", "d"), ways)
    assert not graph.d_separated("a", "d", "b") and not graph.d_separated("a", "d", ["c"])
    assert graph.d_separated("a", "d", "b", "c") and graph.d_separated("a", "d", ["b", "c"])


def test_what_no_arrow_leads_to_an_observation_is_hidden_from_it() -> None:
    network = figure2()
    assert network.hidden("curr") == ()
    assert network.hidden("pos") == ("m", "f", "alpha", "beta", "z")
    assert network.without("f", "curr").hidden("curr") == ("f",)
    assert network.hidden("tone") == ()  # nothing is said of it


def test_a_network_prints_its_nodes_and_edges() -> None:
    text = str(figure2())
    for line in ("Coulomb friction", "f -> alpha", "m -> alpha", "f <-> z", "k(t) -> k(t+1)"):
        assert line in text


def seen_friction(network: Network, count: int) -> Array:
    """Mean of alpha after friction alone has been seen at 1.0, `count` times."""
    process = compile_linear(network, ONE_EACH)
    row = np.zeros((1, 6))
    row[0, process.names.index("f_0")] = 1.0
    model: Joined[Tick] = Joined(process, AffineObservation(6, lambda u: row, 0.01 * np.eye(1)))
    return track(Kalman(), model, [Tick()] * count, np.ones((count, 1)))["alpha_0"]


def test_removing_an_edge_changes_what_is_inferred() -> None:
    network = wandering(figure2())
    led = seen_friction(network, 20)
    assert led[-1] == pytest.approx(0.5, rel=0.02)  # coefficient times friction, nearly known
    np.testing.assert_array_equal(seen_friction(network.without("f", "alpha"), 20), 0.0)


def test_removing_an_edge_removes_what_followed_from_it_between_slices() -> None:
    network = figure2().without("f", "alpha")
    assert network.parents("alpha'") == {"alpha", "m", "m'"}
    assert len(network.edges) == len(figure2().edges) - 1


def test_an_edge_is_removed_alone_and_a_shared_disturbance_from_either_end() -> None:
    assert figure2().without("z", "f").edges == figure2().without("f", "z").edges
    both = Network((A, B), (Edge("a", "b"), Edge("b", "a", 0.5, shared=True)))
    assert both.without("a", "b").edges == (Edge("b", "a", 0.5, shared=True),)
    assert both.without("b", "a").edges == (Edge("a", "b"),)


def test_health_follows_friction_through_their_shared_disturbance() -> None:
    compiled = compile_linear(wandering(figure2()), ONE_EACH)
    f, z = (compiled.names.index(n) for n in ("f_0", "z_0"))
    for cov in (compiled.prior.cov, compiled.transition_cov(Tick())):
        assert cov[f, z] / np.sqrt(cov[f, f] * cov[z, z]) == pytest.approx(-0.3)
    assert compile_linear(figure2().without("f", "z"), ONE_EACH).prior.cov[f, z] == 0.0


def test_what_the_graph_separates_is_independent_in_the_compiled_model() -> None:
    """Over the parameters of both slices; own parts are forgotten at different speeds."""
    network = figure2()
    times = dict(zip(ONE_EACH, (9.0, 7.0, 5.0, 3.0, 2.0, 4.0), strict=True))
    network = replace(
        network,
        nodes=tuple(
            replace(n, diffusion=0.3, time_constant=times.get(n.name, 1.0)) for n in network.nodes
        ),
    )
    model = compile_linear(network, ONE_EACH)
    F, Q, P = (
        model.transition_jacobian(model.mean, Tick()),
        model.transition_cov(Tick()),
        model.prior.cov,
    )
    cov = np.block([[P, P @ F.T], [F @ P, F @ P @ F.T + Q]])
    names = [*ONE_EACH, *(f"{n}'" for n in ONE_EACH)]
    separated = 0
    for a, b in combinations(range(12), 2):
        rest = [i for i in range(12) if i not in (a, b)]
        for given in [g for size in (0, 1, 2, 3) for g in combinations(rest, size)]:
            if network.d_separated(names[a], names[b], *(names[g] for g in given)):
                chosen = [a, b, *given]
                assert abs(np.linalg.inv(cov[np.ix_(chosen, chosen)])[0, 1]) < 1e-9
                separated += 1
    assert separated > 1000


def test_the_first_slice_and_the_wandering_agree_with_a_simulation() -> None:
    """Own parts drawn one by one; covariances of 20,000 draws within four standard errors."""
    rng, draws = np.random.default_rng(1), 20_000
    network = wandering(figure2())
    model = compile_linear(network, ONE_EACH)
    own = rng.standard_normal((draws, 6))
    own[:, 5] = -0.3 * own[:, 2] + np.sqrt(1 - 0.3**2) * own[:, 5]
    x = own.copy()
    x[:, 3] += 0.5 * x[:, 2] + 0.1 * x[:, 1]
    variances = np.diag(model.prior.cov)
    error = np.sqrt(2 * np.outer(variances, variances) / draws)
    assert (np.abs(np.cov(x.T) - model.prior.cov) < 4 * error).all()
    np.testing.assert_allclose(model.transition_cov(Tick(2.0)), 0.02 * model.prior.cov)
    np.testing.assert_allclose(model.transition_jacobian(model.mean, Tick()), np.eye(6), atol=1e-15)


def test_groups_of_different_size_are_led_by_a_pattern() -> None:
    sizes = {"k": 3, "m": 20, "f": 2, "alpha": 2, "beta": 2, "z": 2}
    with pytest.raises(InputError, match="pattern"):
        compile_linear(figure2(), sizes)
    masses = np.zeros((2, 20))
    masses[[0, 1], [0, 10]] = 1.0
    model = compile_linear(figure2(), sizes, {("m", "alpha"): masses})
    at = places(figure2(), sizes)
    np.testing.assert_allclose(model.B[at["alpha"], at["m"]], 0.1 * masses)
    assert len(model.names) == 31 and model.names[at["f"]] == ("f_0", "f_1")


def test_shared_disturbances_go_by_patterns_too() -> None:
    network = Network((Node("a", sd=2.0), Node("b")), (Edge("a", "b", 0.5, shared=True),))
    with pytest.raises(InputError, match="pattern"):
        compile_linear(network, {"a": 2, "b": 1})
    model = compile_linear(network, {"a": 2, "b": 1}, {("a", "b"): np.array([[0.0, 1.0]])})
    np.testing.assert_allclose(model.own, [[4.0, 0.0, 0.0], [0.0, 4.0, 1.0], [0.0, 1.0, 1.0]])


def test_nodes_have_components_of_their_own() -> None:
    network = Network(
        (Node("a", mean=(1.0, 2.0), sd=(0.1, 0.2)), Node("b")), (Edge("a", "b", 2.0),)
    )
    model = compile_linear(network, {"a": 2, "b": 2})
    np.testing.assert_allclose(model.prior.mean, [1.0, 2.0, 0.0, 0.0])
    np.testing.assert_allclose(model.prior.sd, [0.1, 0.2, np.sqrt(1.04), np.sqrt(1.16)])


TRIANGLE = Network(
    (A, B, Node("c")),
    tuple(Edge(*ends, 0.9 if "b" in ends else -0.9, shared=True) for ends in ("ab", "bc", "ac")),
)


@pytest.mark.parametrize(
    "asked, said",
    [
        (lambda: figure2()["nope"], "no node nope; there are k, m, f"),
        (lambda: figure2().parents("nope"), "no node nope; there are k, m, f"),
        (lambda: figure2().children("nope'"), "no node nope'"),
        (lambda: figure2().markov_blanket("nope"), "no node nope"),
        (lambda: figure2().d_separated("curr", "alfa"), "no node alfa"),
        (lambda: figure2().d_separated("nope", "f"), "no node nope"),
        (lambda: figure2().d_separated("k", "f", "nope"), "no node nope"),
        (lambda: figure2().without("f", "nope"), "no edge joins f to nope; there are f -> alpha"),
        (lambda: Network((A, B, A), ()), "two nodes are named a"),
        (lambda: Network((A, Node("a'")), ()), "two nodes are named a'"),
        (lambda: Network((A,), (Edge("a", "b"),)), "no node b; there are a"),
        (lambda: Network((A, B), (Edge("a", "b"), Edge("b", "a"))), "circle"),
        (lambda: Edge("a", "a", shared=True), "joins two"),
        (lambda: Edge("a", "b", 1.5, shared=True), "correlation"),
        (lambda: Edge("a", "b", np.nan), "finite"),
        (lambda: Node("a", sd=-1.0), "a: .* sd"),
        (lambda: Node("a", sd=(1.0, np.nan)), "a: .* sd"),
        (lambda: Node("a", diffusion=-1.0), "diffusion"),
        (lambda: Node("a", mean=np.inf), "mean"),
        (lambda: Node("a", time_constant=0.0), "time constant"),
        (lambda: Node("a", kind="latent"), "take parameter or observation"),  # type: ignore[arg-type]
        (lambda: figure2().parents(["f"]), "no node .*f.*; there are"),  # type: ignore[arg-type]
        (lambda: figure2().d_separated("k", "f", ["m", "nope"]), "no node nope"),
        (lambda: figure2().d_separated("k", "f", "m", "nope"), "no node nope"),
        (lambda: figure2().slice.d_separated("k", "f", "nope"), "no node nope"),
        (
            lambda: Network((A, B), (Edge("a", "b"), Edge("a", "b", 2.0))),
            "a -> b .* once",
        ),
        (
            lambda: Network((A, B), tuple(Edge(*e, 0.1, shared=True) for e in ("ab", "ba"))),
            "a <-> b .* more than once",
        ),
        (lambda: Network((A, SEEN), (Edge("y", "a"),)), "y -> a: what is observed leads nothing"),
        (lambda: Network((A, SEEN), (Edge("a", "y", 0.1, shared=True),)), "a <-> y: .* shares"),
        (lambda: compile_linear(TRIANGLE, dict.fromkeys("abc", 1)), r"a <-> b \(\+0.9\)"),
        (lambda: compile_linear(Network((A, B), ()), {"a": 1}), "b has no size"),
        (lambda: places(Network((A, B), ()), {"a": 1}), "b has no size"),
        (lambda: compile_linear(Network((A,), ()), {"a": -1}), "a has no size"),
        (lambda: compile_linear(Network((SEEN,), ()), {}), "no parameters"),
        (
            lambda: compile_linear(Network((Node("a", mean=(1.0, 2.0)),), ()), {"a": 3}),
            "a has 3 components, and of mean 2 values",
        ),
        (
            lambda: compile_linear(figure2(), ONE_EACH, {("m", "alpha"): np.ones((2, 2))}),
            "pattern for .*alpha.* shape",
        ),
    ],
)
def test_what_is_no_network_or_not_in_it_is_refused(asked: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked()
