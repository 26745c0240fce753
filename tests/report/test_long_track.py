"""A day's work on one page: small, made in a bounded memory, exact in its tails."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from tracked import JOINTS, columns, diagnosed, growing, summary, write

from urdyn.report.canvas import brief
from urdyn.report.track.history import History
from urdyn.report.track.page import track_page
from urdyn.report.track.trace import POINTS, kept

HOUR = 90_000  # rows of a history
STEP = 0.04  # [s]
COLUMNS = 24  # of a history, that the making of a page may hold at once
SPIKES = {0.01: 9.0, 0.37: -4.0, 0.993: 11.0}  # where in the run [-], one sample [N·m]


def long_run(folder: Path, rows: int) -> Path:
    """With single samples that a careless drawing would lose."""
    table = columns(rows=rows, step=STEP)
    rng, name = np.random.default_rng(1), f"{JOINTS[1]}.coulomb"
    table[name] = 5.0 + 0.05 * rng.standard_normal(rows)
    for share, value in SPIKES.items():
        table[name][int(share * rows)] = value
    table[f"{name}.sd"][int(0.6 * rows)] = 3.0
    return write(folder / f"history-{rows}.parquet", table)


def made(history: Path) -> tuple[str, float]:
    """A page, and the most memory that making it took [bytes], over what it is."""
    told = summary(**diagnosed(growing()))
    tracemalloc.start()
    page = track_page(History((history,)), told)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return page, peak


@pytest.mark.parametrize("hours", [1, pytest.param(8, marks=pytest.mark.slow)])
def test_memory_grows_by_a_few_columns_and_the_page_hardly(tmp_path, hours):
    short, long = (long_run(tmp_path, rows) for rows in (HOUR // 10, hours * HOUR))
    (small, little), (page, much) = made(short), made(long)
    assert len(page.encode()) < min(10e6, 1.2 * len(small.encode()))
    assert much - little < COLUMNS * 8 * hours * HOUR
    assert pa.default_memory_pool().bytes_allocated() < 8 * 8 * hours * HOUR


@pytest.mark.parametrize("hours", [1, pytest.param(8, marks=pytest.mark.slow)])
def test_no_extreme_of_a_long_run_is_lost(tmp_path, hours):
    history = History((long_run(tmp_path, hours * HOUR),))
    series = history.series(JOINTS[1], "coulomb")
    at = kept(series)
    assert len(at) <= POINTS
    for whole in (series.mean, series.mean - series.half, series.mean + series.half):
        assert (whole[at].min(), whole[at].max()) == (whole.min(), whole.max())
    for value in SPIKES.values():
        assert np.isclose(brief(series.mean[at]), value).any()


def test_a_long_page_opens_at_once_and_is_drawn_soon(chromium, tmp_path, record_property):
    page = tmp_path / "report.html"
    page.write_text(made(long_run(tmp_path, HOUR))[0], encoding="utf-8")
    chromium.open(page)
    opened = chromium.open(page)  # the first one starts the browser, too
    record_property("opened_s", opened)
    record_property("drawn_s", chromium.drawn)
    assert opened < 15.0  # measured: below 1 s; here only that nothing waits for anything
    assert re.search(r"<h2>Trends</h2>", page.read_text(encoding="utf-8"))
    assert chromium.look()["empty"] == []
