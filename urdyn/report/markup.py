"""Elements of HTML: every text that enters a page is escaped here, which mypy enforces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import NewType

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

Html = NewType("Html", str)  # text that is safe to put on a page

CANVAS = '<div class="plot"'  # what a page needs Plotly for


def text(value: object) -> Html:
    """`value` as it reads, whatever it holds."""
    return Html(escape(str(value)))


def join(parts: Iterable[Html]) -> Html:
    """Parts one after the other."""
    return Html("\n".join(parts))


def tag(name: str, *parts: Html, kind: str = "") -> Html:
    """An element with a class."""
    attribute = f' class="{escape(kind)}"' if kind else ""
    return Html(f"<{name}{attribute}>{join(parts)}</{name}>")


def paragraph(words: str, kind: str = "") -> Html:
    """Words."""
    return tag("p", text(words), kind=kind)


def section(title: str, lead: str, *parts: Html) -> Html:
    """A titled part of the page; `lead` says what it shows and how to read it."""
    return tag("section", tag("h2", text(title)), paragraph(lead, "lead"), *parts)


def grid(*parts: Html, kind: str = "three") -> Html:
    """Parts side by side where the page is wide enough."""
    return tag("div", *parts, kind=f"grid {kind}")


def facts(told: Mapping[str, str]) -> Html:
    """A line of a few numbers, each under its name."""
    pairs = (tag("div", tag("dt", text(name)), tag("dd", text(x))) for name, x in told.items())
    return tag("dl", *pairs, kind="facts")


def key(colours: Mapping[str, str]) -> Html:
    """What the colours of the plots below mean."""
    swatch = '<i style="background:{}"></i>'
    parts = (tag("span", Html(swatch.format(text(c))), text(word)) for word, c in colours.items())
    return tag("p", *parts, kind="key")


def plot(
    figure: go.Figure, title: str, note: str = "", colours: Mapping[str, str] | None = None
) -> Html:
    """A plot under its title; page.js draws what the script beside it holds."""
    # "<" never appears inside the JSON: no text in it can end the script.
    spec = figure.to_json().replace("<", "\\u003c")
    caption = tag("figcaption", tag("b", text(title)), tag("span", text(note)))
    legend = key(colours) if colours else Html("")
    data = Html(f'<script type="application/json">{spec}</script>')
    canvas = Html(f'{CANVAS} style="height:{figure.layout.height}px"></div>')
    return tag("figure", caption, legend, canvas, data)


def table(head: Sequence[str], rows: Iterable[Sequence[Html]], kind: str = "") -> Html:
    """A table; the first cell of a row names it."""
    top = tag("tr", *(tag("th", text(word)) for word in head))
    body = (tag("tr", tag("th", row[0]), *(tag("td", cell) for cell in row[1:])) for row in rows)
    whole = tag("table", tag("thead", top), tag("tbody", *body))
    return tag("div", whole, kind=f"scroll {kind}".strip())


def cell(value: str, small: str = "", kind: str = "") -> Html:
    """A value over a smaller remark."""
    remark = tag("small", text(small)) if small else Html("")
    return tag("span", text(value), remark, kind=kind or "value")


def document(title: str, *parts: Html) -> str:
    """The whole page, with only what it needs inside."""
    body = join(parts)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{text(title)}</title>\n<style>\n{_file('page.css')}</style>\n"
        f"</head>\n<body>\n<main>\n{body}\n</main>\n"
        f"{_drawing() if CANVAS in body else ''}</body>\n</html>\n"
    )


def _drawing() -> Html:
    """The script that draws plots."""
    return Html(f"<script>{get_plotlyjs()}</script>\n<script>\n{_file('page.js')}</script>\n")


@cache
def _file(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")
