"""A real browser draws the pages whole: wide and narrow, light and dark, and on paper."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from tracked import JOINTS, START, columns, diagnosed, growing, summary, write

from urdyn.report.canvas import JOINTS as JOINT_COLOURS
from urdyn.report.canvas import figure, line, rule
from urdyn.report.identify.page import identify_page
from urdyn.report.markup import document, plot
from urdyn.report.track.history import History
from urdyn.report.track.page import track_page

LOOKS = [(1280, "light"), (420, "dark")]
MORE = [pytest.param(*look, marks=pytest.mark.slow) for look in ((1280, "dark"), (420, "light"))]
OF_A_RUN = [
    "Findings", "Forecast", "Payload", "Margins, power, prediction", "Trends", "Surprise",
    "Link masses", "Network", "Data quality", "Speed and provenance",
]  # fmt: skip
QUANTITIES = {
    "joints": [
        {
            "name": name, "torque_margin": 0.4, "torque_margin_sd": 0.01, "power_W": 20.0,
            "friction_power_W": 8.0, "rmse_A": 0.1, "rre_percent": 5.0,
            "commissioned_rre_percent": 9.0,
        }
        for name in JOINTS
    ],
    "payload_margin_kg": {"value": 3.0, "sd": 0.1, "by": "torque"},
    "torque_payload_margin_kg": {"value": 3.0, "sd": 0.1}, "energy_J": 900.0, "friction_J": 300.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tracked")
    history = write(folder / "history.parquet", columns(), provenance={"source": "a" * 300})
    told = diagnosed(growing(), growing(rate=0.0, joint=0, name="shoulder_joint"))
    whole = summary(quantities=QUANTITIES, payload_changes=[START + 20.0], **told)
    page = folder / "report.html"
    page.write_text(track_page(History((history,)), whole), encoding="utf-8")
    return page


@pytest.fixture(scope="module")
def identified_page(case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    page = tmp_path_factory.mktemp("identified") / "report.html"
    page.write_text(
        identify_page(case.fit, case.scores, "urdyn", 2.5, case.truth), encoding="utf-8"
    )
    return page


def whole(chromium: Browser, page: Path, width: int, scheme: str) -> dict:
    """The page as it looks, once it is known to be whole."""
    chromium.open(page, width, scheme)
    seen = chromium.look()
    assert chromium.complaints == []
    assert seen["plots"] == page.read_text(encoding="utf-8").count('class="plot"') > 0
    assert seen["empty"] == [] and seen["wide"] == [] and seen["overflow"] <= 0
    dark = [sum(map(int, re.findall(r"\d+", seen[of])[:3])) for of in ("ink", "paper")]
    assert (dark[0] > dark[1]) == (scheme == "dark")
    return seen


@pytest.mark.parametrize(("width", "scheme"), [*LOOKS, *MORE])
def test_every_part_of_a_tracked_page_is_drawn(chromium, tracked, width, scheme):
    assert whole(chromium, tracked, width, scheme)["sections"] == OF_A_RUN


@pytest.mark.parametrize(("width", "scheme"), LOOKS)
def test_every_part_of_an_identified_page_is_drawn(chromium, identified_page, width, scheme):
    assert whole(chromium, identified_page, width, scheme)["plots"] > 20


def test_the_network_is_drawn_in_the_colours_of_the_page(chromium, tracked):
    colours = {}
    for scheme in ("light", "dark"):
        chromium.open(tracked, 1280, scheme)
        fill = "getComputedStyle(document.querySelector('.network {}')).fill"
        colours[scheme] = [chromium.evaluate(fill.format(part)) for part in (".page", ".title")]
        circles = "document.querySelectorAll('.network circle').length"
        assert chromium.evaluate(circles) == 2 * 10  # parameters in two slices
    assert colours["light"] != colours["dark"]
    assert all(len(set(pair)) == 2 for pair in colours.values())  # ink is not paper


def contrast(one: str, other: str) -> float:
    """Of two colours as a browser tells them, by WCAG; 3 is what it asks of what is not small."""

    def luminance(colour: str) -> float:
        rgb = np.array(re.findall(r"\d+", colour)[:3], dtype=float) / 255.0
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(linear @ (0.2126, 0.7152, 0.0722))

    dark, light = sorted(map(luminance, (one, other)))
    return (light + 0.05) / (dark + 0.05)


def test_what_a_pointer_meets_can_be_read(chromium, tmp_path):
    lines = [line([0, 1], [k, k], f"joint {k}", colour) for k, colour in enumerate(JOINT_COLOURS)]
    (page := tmp_path / "page.html").write_text(document("", plot(figure(lines, "", ""), "")))
    chromium.open(page, 1280, "dark")
    chromium.evaluate(
        """Plotly.Fx.hover(document.querySelector(".plot"),
          [0, 1, 2, 3, 4, 5].map((curveNumber) => ({ curveNumber, pointNumber: 0 })))"""
    )
    met = chromium.evaluate(
        """JSON.stringify([...document.querySelectorAll("g.hovertext")].flatMap((label) => {
          const fill = (part) => getComputedStyle(label.querySelector(part)).fill;
          return [[fill(".name"), fill("rect")], [fill(".nums"), fill("path")]];
        }))"""
    )
    told = json.loads(met)
    assert len({ground for _, ground in told}) == 1 + len(JOINT_COLOURS)
    assert min(contrast(*pair) for pair in told) > 3.0


def test_a_name_in_a_plot_reads_as_it_is_written_and_links_nowhere(chromium, tmp_path):
    name = '<a href="https://there.example">R&D</a> <b>&lt;elbow'
    drawn = figure([line([0, 1], [name, "wrist"], name, "#000")], "", "", shapes=[rule(0.5)])
    drawn.update_shapes(label={"text": name})
    drawn.update_traces(hoverlabel={"namelength": -1})
    (page := tmp_path / "page.html").write_text(document("", plot(drawn, "")))
    chromium.open(page)
    chromium.evaluate(
        """Plotly.Fx.hover(document.querySelector(".plot"), [{ curveNumber: 0, pointNumber: 0 }])"""
    )
    words = ".ytick text, .hovertext text, .shape-group text"
    read = f"JSON.stringify([...document.querySelectorAll('{words}')].map((e) => e.textContent))"
    told = json.loads(chromium.evaluate(read))
    assert len([words for words in told if name in words]) >= 3 and "wrist" in told
    assert chromium.evaluate("document.querySelectorAll('.plot a, .plot tspan[style]').length") == 0


def test_the_levels_of_a_forecast_are_named_in_the_plot(chromium, tracked):
    chromium.open(tracked)
    words = chromium.evaluate(
        "[...document.querySelectorAll('.plot .shape-label, .plot .shape-group text')]"
        ".map((e) => e.textContent).join('|')"
    )
    for level in ("warning +20 %", "critical +50 %", "now", "alarm"):
        assert level in words


def test_a_page_is_printed_with_all_its_plots(chromium, tracked):
    chromium.open(tracked, 1280, "dark")
    assert chromium.printed().startswith(b"%PDF")
    seen = chromium.look()
    assert seen["empty"] == [] and chromium.complaints == []
