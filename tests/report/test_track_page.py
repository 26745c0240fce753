"""The page of a tracked run says what changed and what did not, and stays whole and safe."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from urdyn.errors import LogError
from urdyn.report.track_change import SDS, SHARE, compare_track
from urdyn.report.track_history import History, Series
from urdyn.report.track_page import track_page
from urdyn.report.track_surprise import surprise
from urdyn.report.track_trace import POINTS, trend

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PLOT = re.compile(
    r'<div class="plot".*?</div>\s*<script type="application/json">(.*?)</script>', re.S
)
LIBRARY = re.compile(r"<script>.*?</script>", re.S)
HOSTILE = "</script><script>alert('x')</script><img src=x onerror=alert(1)>"
ROWS, START = 6000, 1000.0
T = START + 0.01 * np.arange(ROWS)  # [s] as a controller stamps it
JOINTS = ("shoulder_joint", "elbow_joint")
COMMISSIONED = {  # mean and sd
    "coulomb": (5.0, 0.1),
    "viscous": (8.0, 0.1),
    "structural": (0.1, 0.01),
    "health": (1.0, 0.01),
    "offset": (0.0, 0.1),
    "zero": (0.0, 3e-4),
}
PEAK = 7.5  # [A] of one sample


def columns(joints=JOINTS) -> dict[str, np.ndarray]:
    """A run in which nothing happens, but for one peak of current and a payload of 2 kg."""
    rng = np.random.default_rng(0)
    beliefs = {f"{j}.{q}": b for j in joints for q, b in COMMISSIONED.items()}
    beliefs |= {f"{j.replace('joint', 'link')}.mass": (4.0, 0.4) for j in joints}
    beliefs |= {"payload.mass": (2.0, 0.1), "payload.mx": (0.1, 0.01)}
    table = {"t": T}
    for name, (mean, sd) in beliefs.items():
        table |= {name: np.full(ROWS, mean), f"{name}.sd": np.full(ROWS, sd)}
    left = 0.1 * rng.standard_normal((ROWS, len(joints)))
    left[ROWS // 3, 0] = PEAK
    left[ROWS // 2 : ROWS // 2 + 500] = np.nan
    measured = np.isfinite(left).sum(axis=1)
    for j in range(len(joints)):
        table |= {f"current_{j}": np.sin(T), f"predicted_{j}": np.sin(T) - left[:, j]}
    nis = rng.chisquare(len(joints), ROWS)
    return table | {"nis": nis, "measured": measured, "widened": np.zeros(ROWS, bool)}


def write(path: Path, table: dict[str, np.ndarray], **metadata: object) -> Path:
    told = {f"urdyn.{key}": json.dumps(value) for key, value in metadata.items()}
    pq.write_table(pa.table(table).replace_schema_metadata(told), path)
    return path


def summary(**changed: object) -> dict[str, object]:
    return {
        "robot": "ur5e", "samples": ROWS, "data_s": 60.0, "wall_s": 6.0, "rate_hz": 1000.0,
        "latency_ms": {"p50": 1.0, "p99": 2.0, "max": 9.0}, "rss_mb": 300.0, "filter": "EKF",
        "mode": "log", "final": {}, "payload_changes": [],
    } | changed  # fmt: skip


@pytest.fixture(scope="module")
def quiet(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("run") / "quiet.parquet", columns())


@pytest.fixture(scope="module")
def page(quiet) -> str:
    return track_page(quiet, summary())


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
    per_joint = 4 + 1 + 1  # trends, residual current, link mass
    assert len(plots) == page.count('class="plot"') == per_joint * len(JOINTS) + 2
    for plot in plots:
        for axis in ("xaxis", "yaxis"):
            assert re.search(r"\[.+\]", plot["layout"][axis]["title"]["text"])
        assert all(len(values(trace["y"])) <= 2000 for trace in plot["data"])


def test_a_constant_run_is_steady(page):
    assert headline(page).startswith("Steady: ")
    assert "outside" not in LIBRARY.sub("", page).split("<body>")[1].split("<section>")[0]


@pytest.mark.parametrize(
    ("quantity", "word"), [("coulomb", "Coulomb friction"), ("health", "health")]
)
def test_a_ramp_names_its_joint_amount_and_time(tmp_path, quantity, word):
    table = columns()
    mean, sd = COMMISSIONED[quantity]
    table[f"elbow_joint.{quantity}"] *= ramp(0.6)
    since = 0.01 * (2000 + (ROWS - 2001) * max(SDS * np.sqrt(2.0) * sd / mean, SHARE) / 0.4)
    said = headline(track_page(write(tmp_path / "run.parquet", table), summary()))
    assert said.startswith(f"Changed: elbow {word} −40 % since {since:.1f} s.")
    assert "shoulder" not in said


def test_a_zero_that_slipped_is_told_in_milliradians(tmp_path):
    table = columns()
    table["elbow_joint.zero"] += np.where(T > START + 30.0, 5e-3, 0.0)
    said = headline(track_page(write(tmp_path / "run.parquet", table), summary()))
    assert said.startswith("Changed: elbow zero +5.0 mrad since 30.0 s.")


@pytest.mark.parametrize(("to", "sd"), [(1.0 + 0.9 * SHARE, 1e-4), (1.2, 0.2)])
def test_a_small_or_doubtful_change_is_steady(to, sd):
    mean = np.linspace(1.0, to, 100)
    found = compare_track(Series("a", "coulomb", "N·m", T[:100], mean, np.full(100, sd)))
    assert found.steady


def test_a_change_that_went_away_again_is_steady():
    mean = np.where((np.arange(100) > 20) & (np.arange(100) < 60), 2.0, 1.0)
    found = compare_track(Series("a", "coulomb", "N·m", T[:100], mean, np.full(100, 0.01)))
    assert found.steady


def test_the_payload_is_told_with_its_interval(page):
    assert "The payload is now 2.00 ± 0.16 kg, with no change noticed" in headline(page)


def test_a_payload_taken_up_is_told_with_its_moment(quiet):
    said = headline(track_page(quiet, summary(payload_changes=[START + 10.0, START + 25.0])))
    assert "2.00 ± 0.16 kg, since 25.0 s, the last of 2 changes." in said


def test_a_payload_within_its_interval_is_not_told_from_none(tmp_path):
    table = columns() | {"payload.mass": np.full(ROWS, 0.05)}
    said = headline(track_page(write(tmp_path / "run.parquet", table), summary()))
    assert "cannot be told from none: 0.05 ± 0.16 kg" in said


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
    drawn = trend(series, History(quiet).clock).data[-1].y
    assert len(drawn) <= POINTS
    assert (drawn.min(), drawn.max()) == pytest.approx((series.mean.min(), series.mean.max()))


def test_white_innovations_lie_in_their_band_as_often_as_it_says(quiet):
    found = surprise(History(quiet))
    for inside, count in (
        (found.inside, ROWS - 500),
        (np.mean((found.mean > found.low) & (found.mean < found.high)), len(found.mean)),
    ):
        assert abs(inside - 0.9) < 4.0 * np.sqrt(0.09 / count)


def test_a_run_in_which_nothing_was_compared_has_a_page(tmp_path):
    table = columns() | {"measured": np.zeros(ROWS, int)}
    assert "No current was compared." in track_page(
        write(tmp_path / "run.parquet", table), summary()
    )


def test_a_run_without_readings_says_what_to_do(tmp_path):
    table = {name: column[:0] for name, column in columns().items()}
    with pytest.raises(LogError, match="track a longer log"):
        track_page(write(tmp_path / "run.parquet", table), summary())


def test_units_and_provenance_come_from_the_file(tmp_path):
    units = {"elbow_joint.coulomb": "furlong"}
    provenance = {"twin": "ab" * 32, "sources": [{"sha256": "cd" * 32}]}
    path = write(tmp_path / "run.parquet", columns(), units=units, provenance=provenance)
    shown = track_page(path, summary())
    titles = [json.loads(plot)["layout"]["yaxis"]["title"]["text"] for plot in PLOT.findall(shown)]
    assert titles.count("friction [furlong]") == 1
    assert "ab" * 32 in shown
    assert "cd" * 32 in shown


def test_hostile_names_are_text(tmp_path, page):
    table = columns((HOSTILE, "elbow_joint"))
    table[f"{HOSTILE}.coulomb"] *= ramp(2.0)
    path = write(tmp_path / "run.parquet", table, provenance={HOSTILE: HOSTILE})
    shown = track_page(path, summary(robot=HOSTILE, filter=HOSTILE, mode=HOSTILE))
    assert shown.count("<script") == page.count("<script")
    assert "<img" not in LIBRARY.sub("", shown)


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_draws_every_plot_without_complaint(tmp_path, page):
    path = tmp_path / "report.html"
    path.write_text(page, encoding="utf-8")
    done = subprocess.run(
        [
            CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--disable-background-networking",
            "--disable-dev-shm-usage", f"--user-data-dir={tmp_path / 'profile'}",
            "--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom", path.as_uri(),
        ],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert "CONSOLE" not in done.stderr
    canvases = re.findall(r'<div class="plot js-plotly-plot".*?</figure>', done.stdout, re.S)
    assert len(canvases) == page.count('class="plot"')
    assert all("main-svg" in canvas for canvas in canvases)
