"""A network as a picture: two slices side by side, self-contained SVG, for light and dark pages.

Its style applies to itself only: inside a page it does not affect other drawings.

Kinds of edge differ in dash as well as in colour (the palette of [Okabe2008]_).
"""

from __future__ import annotations

from html import escape

from urdyn.dbn.graph import Network, Node
from urdyn.dbn.layout import BOX, INSIDE, OBSERVED, RADIUS, ROW, TOP, WIDTH, Place, layout

SYMBOL = {"alpha": "α", "beta": "β"}
KINDS = {
    "within": "a parameter leads another",
    "shared": "shared disturbance",
    "seen": "moves what a sensor sees",
    "across": "leads into the next slice",
}
SHORT = 4  # letters that fit into a circle
STYLE = """
.network{--ink:#1b1b1b;--quiet:#5c5c5c;--page:#ffffff;--node:#f4f4f4;--panel:#d9d9d9;
--within:#0072b2;--shared:#d55e00;--seen:#8a8a8a;--across:#009e73}
@media screen and (prefers-color-scheme:dark){.network{--ink:#eeeeee;--quiet:#b5b5b5;--page:#16181c;
--node:#24272d;--panel:#3a3e46;--within:#56b4e9;--shared:#f0803c;--seen:#8f959e;--across:#2fc79b}}
.network text{font-family:system-ui,sans-serif;fill:var(--ink);text-anchor:middle;
dominant-baseline:central}
.network .page{fill:var(--page)} .network .panel{fill:none;stroke:var(--panel)}
.network .node{fill:var(--node);stroke:var(--ink);stroke-width:1.5}
.network .symbol{font-size:18px;font-style:italic} .network .title{font-size:17px}
.network .note{font-size:12px;fill:var(--quiet)} .network .left{text-anchor:start}
.network path{fill:none;stroke-width:1.8}
.network .within{stroke:var(--within);stroke-width:2.4}
.network .shared{stroke:var(--shared);stroke-dasharray:6 4;stroke-width:2.4}
.network .seen{stroke:var(--seen);stroke-width:1.2}
.network .across{stroke:var(--across);stroke-dasharray:11 3}
""".strip()
MARKER = (
    '<marker id="{0}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="9" markerHeight="9" '
    'markerUnits="userSpaceOnUse" orient="auto-start-reverse">'
    '<path d="M0 1L10 5L0 9z" style="fill:var(--{0});stroke:none"/></marker>'
)


def svg(network: Network) -> str:
    """The two slices of a network as one SVG document."""
    drawn = layout(network)
    height = drawn.height + 70
    now = [_node(n, drawn.now[n.name], "t") for n in network.nodes]
    then = [_node(n, drawn.then[n.name], "t+1") for n in network.nodes]
    parts = [
        f'<rect class="page" width="{WIDTH}" height="{height}"/>',
        *_panels(drawn.height),
        *(_line(drawn.now[p], drawn.then[c], "across") for p, c in network.across),
        *(_within(network, drawn.now) + _within(network, drawn.then)),
        *(now + then + _meanings(network, drawn.now)),
        *_legend(height - 30),
    ]
    label = escape(f"Dynamic Bayesian network of {', '.join(n.name for n in network.nodes)}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="network" role="img" '
        f'viewBox="0 0 {WIDTH} {height}" aria-label="{label}"><style>{STYLE}</style>'
        f"<defs>{''.join(map(MARKER.format, KINDS))}</defs>\n" + "\n".join(parts) + "\n</svg>\n"
    )


def _line(a: Place, b: Place, kind: str, bend: float = 0.0) -> str:
    """An edge, straight or bent aside by `bend` of its length."""
    (x1, y1), (x2, y2) = a.port(b), b.port(a)
    cx, cy = (x1 + x2) / 2 + bend * (y2 - y1), (y1 + y2) / 2 - bend * (x2 - x1)
    heads = f'marker-end="url(#{kind})"'
    if kind == "shared":
        heads += f' marker-start="url(#{kind})"'
    d = f"M{x1:.1f} {y1:.1f}Q{cx:.1f} {cy:.1f} {x2:.1f} {y2:.1f}"
    return f'<path class="{kind}" {heads} d="{d}"/>'


def _within(network: Network, places: dict[str, Place]) -> list[str]:
    """Edges of one slice; straight between neighbours, around the nodes between others."""
    lines = []
    for edge in network.edges:
        a, b = places[edge.parent], places[edge.child]
        kind = "shared" if edge.shared else "within" if a.round == b.round else "seen"
        far = a.x == b.x and abs(a.y - b.y) > 1.5 * ROW
        lines.append(_line(a, b, kind, 0.28 if far else 0.0))
    return lines


def _node(node: Node, at: Place, time: str) -> str:
    """A parameter's circle or an observation's box, with its symbol."""
    symbol = escape(_short(node.name) if at.round else _symbol(node.name))
    index = f'<tspan dy="6" font-size="11">{time}</tspan>'
    if at.round:
        shape = f'<circle class="node" cx="{at.x}" cy="{at.y:.1f}" r="{RADIUS}"/>'
        return f'{shape}<text class="symbol" x="{at.x}" y="{at.y - 2:.1f}">{symbol}{index}</text>'
    (w, h), left = BOX, at.x - BOX[0] / 2
    return (
        f'<rect class="node" x="{left}" y="{at.y - h / 2:.1f}" width="{w}" height="{h}" rx="4"/>'
        f'<text class="symbol" x="{at.x}" y="{at.y - 9:.1f}" {_at_most(w, node.name)}>'
        f"{symbol}{index}</text>"
        f'<text class="note" x="{at.x}" y="{at.y + 12:.1f}">{escape(node.meaning)}</text>'
    )


def _symbol(name: str) -> str:
    return SYMBOL.get(name, name)


def _short(name: str) -> str:
    """What fits into a circle: a symbol, or the initials of a longer name."""
    symbol = _symbol(name)
    return symbol if len(symbol) <= SHORT else "".join(word[:1] for word in name.split("_"))[:SHORT]


def _at_most(width: float, name: str) -> str:
    """A reduced font size for a name that does not fit into a box at the usual one."""
    size = width / (0.6 * len(name) + 1.5)
    return f'style="font-size:{size:.1f}px"' if size < 18.0 else ""


def _meanings(network: Network, places: dict[str, Place]) -> list[str]:
    """Words beside each parameter: its meaning, or its name where that is long.

    They stand on the side of its line on which no other line leaves.
    """
    notes = []
    for node in network.parameters:
        at = places[node.name]
        rising = any(places[c].y < at.y for p, c in network.across if p == node.name)
        x, y = at.x + RADIUS + 8, at.y + (12 if rising else -12)
        told = _short(node.name) == _symbol(node.name)
        words = escape(node.meaning if told else node.name)
        notes.append(f'<text class="note left" x="{x}" y="{y:.1f}">{words}</text>')
    return notes


def _panels(bottom: float) -> list[str]:
    """Frames around the slices, and their titles."""
    left = OBSERVED - BOX[0] / 2 - 16
    width = INSIDE + 64 - left
    parts = []
    for x, name in ((left, "t"), (WIDTH - left - width, "t + 1")):
        frame = f'x="{x}" y="{TOP - 8}" width="{width}" height="{bottom - TOP + 16}" rx="10"'
        parts.append(f'<rect class="panel" {frame}/>')
        parts.append(f'<text class="title" x="{x + width / 2}" y="{TOP - 32}">slice {name}</text>')
    return parts


def _legend(y: float) -> list[str]:
    parts, step = [], (WIDTH - 60) / len(KINDS)
    for i, (kind, words) in enumerate(KINDS.items()):
        x = 40 + i * step
        parts.append(_line(Place(x, y), Place(x + 44, y), kind))
        parts.append(f'<text class="note left" x="{x + 54}" y="{y}">{words}</text>')
    return parts
