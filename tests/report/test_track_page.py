"""The page of a tracked run says what changed and what did not, and stays whole and safe."""

from __future__ import annotations

import base64
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tracked import (
    COMMISSIONED,
    JOINTS,
    PEAK,
    ROWS,
    START,
    T,
    columns,
    diagnosed,
    summary,
    write,
)

from urdyn.errors import LogError
from urdyn.report.track.change import LEVELS, SDS, SHARE, UNSURE, compare_track
from urdyn.report.track.history import History, Series
from urdyn.report.track.page import track_page
from urdyn.report.track.surprise import surprise, surprises
from urdyn.report.track.trace import POINTS, trend
from urdyn.signal import UNSET
from urdyn.tracking.belief.payload_setting import Setting, compared

PLOT = re.compile(
    r'<div class="plot".*?</div>\s*<script type="application/json">(.*?)</script>', re.S
)
LIBRARY = re.compile(r"<script>.*?</script>", re.S)
HOSTILE = "</script><script>alert('x')</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def quiet(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("run") / "quiet.parquet", columns())


@pytest.fixture(scope="module")
def page(quiet) -> str:
    return track_page(History((quiet,)), summary())


def headline(page: str) -> str:
    return re.search(r'<p class="headline">(.*?)</p>', page).group(1).replace("\u00a0", " ")


def ramp(to: float, start: int = 2000) -> np.ndarray:
    """A factor that leaves 1 at a row and is `to` at the end."""
    return np.interp(np.arange(ROWS), [start, ROWS - 1], [1.0, to])


def test_a_page_is_one_file_below_ten_megabytes(page):
    markup = LIBRARY.sub("", page)
    assert not re.search(r"(src|href|@import|url\()\s*=?\s*[\"']?(https?:)?//", markup)
    assert "<link" not in markup
    assert len(re.findall(r"plotly\.js v\d", page)) == 1
    assert len(page.encode()) < 10e6


def test_every_axis_has_a_unit_and_every_trace_is_short(page):
    plots = [json.loads(found) for found in PLOT.findall(page)]
    per_joint = 5 + 1 + 1  # trends, residual current, link mass
    assert len(plots) == page.count('class="plot"') == per_joint * len(JOINTS) + 2
    for plot in plots:
        for axis in ("xaxis", "yaxis"):
            assert re.search(r"\[.+\]", plot["layout"][axis]["title"]["text"])
        assert all(len(values(trace["y"])) <= 2000 for trace in plot["data"])


def test_a_constant_run_is_steady(page):
    assert headline(page).startswith("Steady: ")
    assert "outside" not in LIBRARY.sub("", page).split("<body>")[1].split("<section>")[0]


def test_an_interval_that_allows_for_another_day_is_not_called_that_of_commissioning(page):
    assert "now / commissioned" not in page and page.count("now / expected") == 2
    assert "its interval is wider than at commissioning" in page


@pytest.mark.parametrize(
    ("quantity", "word"), [("coulomb", "Coulomb friction"), ("health", "health")]
)
def test_a_ramp_names_its_joint_amount_and_time(tmp_path, quantity, word):
    table = columns()
    mean, sd = COMMISSIONED[quantity]
    table[f"elbow_joint.{quantity}"] *= ramp(0.6)
    since = 0.01 * (2000 + (ROWS - 2001) * max(SDS * np.sqrt(2.0) * sd / mean, SHARE) / 0.4)
    said = headline(track_page(History((write(tmp_path / "run.parquet", table),)), summary()))
    assert said.startswith(f"Changed: elbow {word} −40 % since {since:.1f} s.")
    assert "shoulder" not in said


def test_a_zero_that_slipped_is_told_in_milliradians(tmp_path):
    table = columns()
    table["elbow_joint.zero"] += np.where(T > START + 30.0, 5e-3, 0.0)
    said = headline(track_page(History((write(tmp_path / "run.parquet", table),)), summary()))
    assert said.startswith("Changed: elbow zero +5.0 mrad since 30.0 s.")


@pytest.mark.parametrize(("to", "sd"), [(1.0 + 0.9 * SHARE, 1e-4), (1.2, 0.2)])
def test_a_small_or_doubtful_change_is_steady(to, sd):
    mean = np.linspace(1.0, to, 100)
    found = compare_track(Series("a", "coulomb", "N·m", T[:100], mean, np.full(100, sd)))
    assert not found.changed


def test_a_change_that_went_away_again_is_steady():
    mean = np.where((np.arange(100) > 20) & (np.arange(100) < 60), 2.0, 1.0)
    found = compare_track(Series("a", "coulomb", "N·m", T[:100], mean, np.full(100, 0.01)))
    assert not found.changed


@pytest.mark.parametrize(("quantity", "then"), [("coulomb", 5.0), ("health", 1.0), ("zero", 0.0)])
def test_what_is_too_little_known_to_show_a_critical_change_is_not_called_steady(quantity, then):
    most = LEVELS[quantity]["critical"] * (then or 1.0) / SDS
    for sd, word in ((0.9 * most, "steady"), (1.1 * most, UNSURE)):
        sds = np.linspace(0.01 * most, sd, 100)
        found = compare_track(Series("a", quantity, "-", T[:100], np.full(100, then), sds))
        assert found.word == word and not found.changed


def test_the_verdict_claims_no_joint_that_nobody_could_observe(tmp_path):
    table = columns()
    for quantity in ("friction", "health"):
        table[f"elbow_joint.{quantity}.sd"] = 0.4 * table[f"elbow_joint.{quantity}"]
    table["shoulder_joint.zero.sd"] = np.full(ROWS, 0.01)
    shown = track_page(History((write(tmp_path / "run.parquet", table),)), summary())
    assert headline(shown).startswith(
        "Steady: friction, damping, health and zero of every joint but shoulder (zero), elbow "
        "(friction, health), of which too little was seen, are as commissioned."
    )
    assert shown.count("0 sd, unsure") == 2


def test_levels_of_a_run_that_tells_none_are_those_of_the_built_in_rules():
    assert diagnosed()["levels"] == LEVELS


def test_the_payload_is_told_with_its_interval(page):
    assert "The payload is now 2.00 ± 0.16 kg." in headline(page)


def test_a_payload_taken_up_is_told_with_its_moment(quiet):
    said = headline(
        track_page(History((quiet,)), summary(payload_changes=[START + 10.0, START + 25.0]))
    )
    assert "2.00 ± 0.16 kg, since 25.0 s, the last of 2 changes." in said


def test_a_payload_within_its_interval_is_not_told_from_none(tmp_path):
    table = columns() | {"payload.mass": np.full(ROWS, 0.05)}
    said = headline(track_page(History((write(tmp_path / "run.parquet", table),)), summary()))
    assert "cannot be distinguished from none: 0.05 ± 0.16 kg" in said


def test_a_payload_that_the_motion_does_not_tell_is_no_headline(quiet):
    said = headline(track_page(History((quiet,)), summary(payload_known=False)))
    assert "The currents say too little of the payload." in said and "2.00" not in said


@pytest.mark.parametrize(
    ("off", "known", "words"),
    [
        (1.5, True, "is set to 0.50 kg: 1.50 kg too little."),
        (-0.25, True, "is set to 0.50 kg: 0.25 kg too much."),
        (1.5, False, "is set to 0.50 kg: at least 1.50 kg too little."),
        (None, True, "is set to 0.50 kg."),
    ],
)
def test_the_payload_is_held_against_what_the_controller_is_set_to(quiet, off, known, words):
    setting = compared(Setting(np.r_[0.5, UNSET[1:]]), 2.0, 1.0, known, False) | {"off_kg": off}
    said = headline(track_page(History((quiet,)), summary(payload_setting=setting))).replace(
        "\u00a0", " "
    )
    assert f"2.00 ± 0.16 kg. The controller {words}" in said


def test_extremes_outlive_decimation(page):
    residual = next(
        trace
        for found in PLOT.findall(page)
        for trace in json.loads(found)["data"]
        if trace.get("name") == "residual"
    )
    y = values(residual["y"])
    assert len(y) <= POINTS < ROWS
    assert np.nanmax(y) == pytest.approx(PEAK, rel=1e-6)


def values(drawn) -> np.ndarray:
    """Numbers as plotly writes them: a list, or bytes in base 64."""
    if isinstance(drawn, dict):
        return np.frombuffer(base64.b64decode(drawn["bdata"]), drawn["dtype"])
    return np.array(drawn, float)


def test_a_trend_keeps_its_highest_and_lowest_mean(quiet):
    rng = np.random.default_rng(1)
    series = Series("a", "coulomb", "N·m", T, rng.standard_normal(ROWS), np.full(ROWS, 0.1))
    drawn = trend(series, History((quiet,)).clock).data[-1].y
    assert len(drawn) <= POINTS
    assert (drawn.min(), drawn.max()) == pytest.approx((series.mean.min(), series.mean.max()))


def test_white_innovations_lie_in_their_band_as_often_as_it_says(quiet):
    found = surprise(History((quiet,)))
    for inside, count in (
        (found.inside, ROWS - 500),
        (np.mean((found.mean > found.low) & (found.mean < found.high)), len(found.mean)),
    ):
        assert abs(inside - 0.9) < 4.0 * np.sqrt(0.09 / count)


def test_a_page_does_not_wait_for_statistics_of_which_it_draws_nothing():
    """They take a second to load."""
    code = "import sys, urdyn.report.track.page; print(sys.modules.keys() & set(sys.argv[1:]))"
    heavy = (sys.executable, "-c", code, "scipy.stats", "scipy.signal")
    assert subprocess.run(heavy, capture_output=True, text=True, check=True).stdout == "set()\n"


def test_a_current_that_reads_0_throughout_has_a_residual_and_no_share(tmp_path):
    """As a recorder of whole amperes writes a light joint's."""
    history = History(
        (write(tmp_path / "zero.parquet", columns() | {"current_1": np.zeros(ROWS)}),)
    )
    told = str(surprises(history, surprise(history)))
    assert "of the current" in told and "A, where the current reads 0" in told


def test_what_a_change_explains_is_no_surprise(quiet, tmp_path):
    """A large one for a second, after which another payload is told."""
    table, change = columns(), 1000
    before = (T[change] - 1.0 < T) & (T[change] >= T)
    table["nis"] = table["nis"] + 500.0 * before
    table["widened"] = np.arange(ROWS) == change
    explained = surprise(History((write(tmp_path / "told.parquet", table),))).overall
    assert explained == pytest.approx(surprise(History((quiet,))).overall, rel=0.1)
    table["widened"] = np.zeros(ROWS, bool)
    assert surprise(History((write(tmp_path / "not.parquet", table),))).overall > 1.5 * explained


def test_a_few_gross_errors_do_not_make_a_run_surprising(quiet, tmp_path):
    """In one row of two hundred a current is torn; in one of twenty, something is missing."""
    calm = surprise(History((quiet,))).overall
    for every, missing in ((200, False), (20, True)):
        table = columns()
        table["nis"] = table["nis"] + 3000.0 * (np.arange(ROWS) % every == 0)
        torn = surprise(History((write(tmp_path / f"{every}.parquet", table),))).overall
        assert (torn > 1.1 * calm) == missing


def test_a_run_in_which_nothing_was_compared_has_a_page(tmp_path):
    table = columns() | {"measured": np.zeros(ROWS, int)}
    assert "No current was compared." in track_page(
        History((write(tmp_path / "run.parquet", table),)), summary()
    )


def test_a_run_without_readings_says_what_to_do(tmp_path):
    table = {name: column[:0] for name, column in columns().items()}
    with pytest.raises(LogError, match="track a longer log"):
        track_page(History((write(tmp_path / "run.parquet", table),)), summary())


def test_units_and_provenance_come_from_the_file(tmp_path):
    units = {"elbow_joint.friction": "furlong"}
    provenance = {"twin": "ab" * 32, "sources": [{"sha256": "cd" * 32}]}
    path = write(tmp_path / "run.parquet", columns(), units=units, provenance=provenance)
    shown = track_page(History((path,)), summary())
    titles = [json.loads(plot)["layout"]["yaxis"]["title"]["text"] for plot in PLOT.findall(shown)]
    assert titles.count("friction [furlong]") == 1
    assert "ab" * 32 in shown
    assert "cd" * 32 in shown


def test_hostile_names_are_text(tmp_path, page):
    table = columns((HOSTILE, "elbow_joint"))
    table[f"{HOSTILE}.coulomb"] *= ramp(2.0)
    path = write(tmp_path / "run.parquet", table, provenance={HOSTILE: HOSTILE})
    shown = track_page(History((path,)), summary(robot=HOSTILE, filter=HOSTILE, mode=HOSTILE))
    assert shown.count("<script") == page.count("<script")
    assert "<img" not in LIBRARY.sub("", shown)
