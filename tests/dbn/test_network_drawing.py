"""The drawing shows every node and every edge, in both slices, and needs nothing from elsewhere."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter

import pytest

from urdyn.dbn import Edge, Network, Node, figure2, svg
from urdyn.dbn.layout import BOX

ODD = Network(
    (*(Node(f"p{i}", "a & b < c") for i in range(10)), Node("y", kind="observation")),
    (Edge("p0", "p9"), Edge("p3", "y")),
)
LEGEND = 1  # one sample of each kind of edge


@pytest.mark.parametrize("network", [figure2(), figure2().without("f", "alpha"), ODD])
def test_every_node_and_edge_is_drawn_in_both_slices(network: Network) -> None:
    root = ET.fromstring(svg(network))
    space = "{http://www.w3.org/2000/svg}"
    kinds = Counter(p.get("class") for p in root.findall(f"{space}path"))
    parameters = {n.name for n in network.parameters}
    within = [e for e in network.edges if e.child in parameters]
    assert kinds["within"] == 2 * sum(not e.shared for e in within) + LEGEND
    assert kinds["shared"] == 2 * sum(e.shared for e in within) + LEGEND
    assert kinds["seen"] == 2 * (len(network.edges) - len(within)) + LEGEND
    assert kinds["across"] == len(network.across) + LEGEND
    assert len(root.findall(f"{space}circle")) == 2 * len(network.parameters)
    boxes = [r for r in root.findall(f"{space}rect") if r.get("class") == "node"]
    assert len(boxes) == 2 * len(network.observations)


def test_a_drawing_stands_alone_and_serves_light_and_dark_pages() -> None:
    text = svg(figure2())
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")
    assert "prefers-color-scheme:dark" in text and "<script" not in text
    assert 'role="img"' in text and "aria-label" in text


def test_a_long_name_stands_where_there_is_room_for_it() -> None:
    names = Node("elbow_friction"), Node("current_of_the_elbow", kind="observation")
    text = svg(Network(names, (Edge(*(n.name for n in names)),)))
    assert ">ef<tspan" in text and ">elbow_friction</text>" in text
    (size,) = set(re.findall(r'font-size:([\d.]+)px">current_of_the_elbow', text))
    assert 0.5 * float(size) * len("current_of_the_elbow") < BOX[0]
