"""The page is one file, whole, honest about its data and safe whatever a log is called."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from urdyn.report.digits import number
from urdyn.report.identify.page import identify_page, validate_page
from urdyn.report.origin import data_quality
from urdyn.types import Source

PLOT = re.compile(
    r'<div class="plot".*?</div>\s*<script type="application/json">(.*?)</script>', re.S
)
COMMAND = "urdyn identify run.csv --robot ur5e --out twin"
LIBRARY = re.compile(r"<script>.*?</script>", re.S)
HOSTILE = "</script><script>alert('x')</script><img src=x onerror=alert(1)>.csv"


@pytest.fixture(scope="module")
def page(case) -> str:
    return identify_page(case.fit, case.scores, COMMAND, 2.5, case.truth)


def markup(page: str) -> str:
    """The page without its scripts."""
    return LIBRARY.sub("", page)


@pytest.fixture(scope="module", params=["identify", "validate"])
def either(request, case, page) -> str:
    return page if request.param == "identify" else validate_page(case.fit, case.scores, COMMAND)


def test_a_page_asks_nothing_of_the_network(either):
    assert not re.search(r"(src|href|@import|url\()\s*=?\s*[\"']?(https?:)?//", markup(either))
    assert "<link" not in markup(either)


def test_a_page_is_below_ten_megabytes_and_holds_plotly_once(either):
    assert len(either.encode()) < 10e6
    assert len(re.findall(r"plotly\.js v\d", either)) == 1


def test_every_plot_has_data_and_a_unit_on_every_numeric_axis(either):
    plots = [json.loads(found) for found in PLOT.findall(either)]
    assert len(plots) == either.count('class="plot"') > 6
    for plot in plots:
        assert any(len(trace["x"]) and len(trace["y"]) for trace in plot["data"])
        for name, axis in plot["layout"].items():
            if re.fullmatch(r"[xy]axis\d?", name) and axis["title"]["text"]:
                assert re.search(r"\[.+\]", axis["title"]["text"])


def test_the_rate_of_a_log_is_its_rows_over_its_duration(case):
    """Where single rows are missing, the usual step is that of more rows than there are."""
    score = case.scores[0]
    rows = np.arange(len(score.log))
    step, steps = score.duration / rows[-1], rows[-1]
    lossy = replace(score.log, t=score.log.t + step * (rows // 10))
    told = data_quality(case.fit, [replace(score, log=lossy)])
    assert f">{number(steps / (steps + steps // 10) / step, 3)} Hz</td>" in told
    assert f">{number(1.0 / step, 3)} Hz</td>" not in told


def test_a_tool_that_was_named_is_shown_beside_the_payload(case, page):
    assert "Tool:" not in page
    tool = np.array([1.5, 1.5 * 0.01, 0.0, 1.5 * 0.06, *[0.0] * 6])
    borne = replace(case.fit, tool_known=True, dynamics=replace(case.fit.dynamics, payload=tool))
    told = identify_page(borne, case.scores, COMMAND, 2.5)
    assert "Tool: 1.50 kg, centre of mass at 10.0, 0, 60.0 mm in the flange frame" in told
    bare = replace(case.fit, tool_known=True)
    assert "Tool: none in these logs" in identify_page(bare, case.scores, COMMAND, 2.5)


def test_a_hostile_log_name_is_text(case):
    log = replace(case.seen.log, source=Source(HOSTILE, "", None))
    hostile = replace(case.seen, log=log)
    fit = replace(case.fit, sources=(log.source,))
    shown = identify_page(fit, [hostile], f"urdyn identify '{HOSTILE}'", 1.0)
    harmless = identify_page(case.fit, [case.seen], COMMAND, 1.0)
    assert shown.count("<script") == harmless.count("<script")
    assert "<img" not in markup(shown)


def test_the_headline_rests_on_what_was_held_out(case, page):
    headline = re.search(r'<p class="headline">(.*?)</p>', page).group(1)
    assert "has not seen" in headline
    for values in (case.unseen.rre_percent, case.unseen.floor_percent):
        assert f"{number(values.min())} %" in headline
        assert f"{number(values.max())} %" in headline


def test_a_page_of_training_data_says_so(case):
    shown = validate_page(case.fit, [case.seen], COMMAND)
    assert "has not seen" not in shown
    assert "seen in training" in shown


def test_a_page_names_joints_hashes_and_the_command(page):
    for words in ("shoulder pan", "ab" * 32, COMMAND, "held out", "of 84"):
        assert words in page
    assert "shoulder_pan" not in markup(page)


def test_the_same_fit_gives_the_same_page(case, page):
    assert identify_page(case.fit, case.scores, COMMAND, 2.5, case.truth) == page


def test_a_page_without_scores_still_tells_of_friction_and_mass(case):
    shown = identify_page(case.fit, [], COMMAND, 1.0)
    assert "No log was scored" in shown
    assert len(PLOT.findall(shown)) == 8
