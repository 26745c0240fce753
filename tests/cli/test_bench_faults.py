"""The bench of fault detection as a user runs it, with few lives: numbers are tested elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from story import urdyn
from typer.testing import CliRunner

from urdyn.bench import FAULTS
from urdyn.cli.app import app
from urdyn.cli.bench_faults import _rates
from urdyn.report.bench.figure_four import Foreseen, Told, beside, figures
from urdyn.report.bench.table_three import Row


def test_the_paper_is_beside_ours(tmp_path: Path) -> None:
    page = tmp_path / "faults.html"
    few = ("--lives", "12", "--runs", "0")
    done = urdyn("bench", "faults", *few, "--json", "--out", str(page))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {row["fault"] for row in told["faults"]} == {"friction increase", "health degradation"}
    steep = [row for row in told["faults"] if row["ratio"] >= 0.1]
    assert all(r["found"] == 1.0 for r in steep if r["detector"] == "Shiryaev-Roberts")
    assert all(row["lives"] <= 12 for row in told["faults"])
    assert "of 12 runs" in page.read_text()
    assert "82 %" in done.stderr and "Table III" in page.read_text()
    for row, of in zip(told["table3"], FAULTS, strict=True):
        assert row["fault"] == of.name and of.name in done.stderr
        assert row["paper"] == {"found": of.found, "fp_rate": of.false, "delay": of.steps}
        assert bool(row["scenario"]) == (of.name in {r["fault"] for r in told["faults"]})
    assert "Table III" in done.stderr and "Figure 4" in done.stderr
    figure, series = told["figure4"], told["figure4"]["series"]
    assert figure["paper"] == {"alarm": 38, "low_by": 0.03, "at": 60, "critical_in": 20}
    assert {len(series[name]) for name in ("t", "truth", "paper_filter", "median")} == {100}
    left = figure["urdyn"]["critical_in"]
    assert series["crossing"]["median"][59] == pytest.approx(60.0 + left["median"])


def test_figure_4_says_how_low_an_estimate_reads_and_what_is_left() -> None:
    t = np.arange(1.0, 101.0)
    truth = 0.1 + 0.0025 * np.maximum(t - 20.0, 0.0)
    ours = np.stack([truth - 0.001, truth - 0.01, truth + 0.01], axis=1)
    crossing = np.tile([80.0, 75.0, np.inf], (100, 1))
    life = Foreseen(t, truth, truth - 0.03, ours, crossing, 0.2, 0.25, 20, 30, 0.025)
    paper = Told(38, 18, 0.03, 60, 20)
    said = figures(life, paper)
    assert said["paper_filter"]["low_by"] == pytest.approx(0.03)
    assert said["urdyn"]["low_by"] == pytest.approx(0.001)
    assert said["urdyn"]["critical_in"] == {"median": 20.0, "lo": 15.0, "hi": None}
    theirs, _, mine = beside(life, paper)
    assert theirs[1:3] == ("38", "18") and mine[1:3] == ("30", "10")
    assert mine[-1] == "20.0 (15.0 to no end), said at 60"


def test_no_digit_is_left_out_on_80_columns() -> None:
    row = Row("health degradation", 0.01, 0.25, "Shiryaev-Roberts", 0.93, 11.3, 1.23, 0.0123, 600)
    with (screen := Console(width=80)).capture() as shown:
        screen.print(_rates([row]))
    assert all(word in shown.get() for word in ("degradation", "0.25", "11.3", "1.23", "0.0123"))


@pytest.mark.slow
def test_all_four_rows_are_measured_and_every_kind_is_counted(tmp_path: Path) -> None:
    page = tmp_path / "faults.html"
    few = ("--lives", "12", "--runs", "1")
    done = urdyn("bench", "faults", *few, "--json", "--out", str(page))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    for row in told["table3"]:
        assert row["arm"]["runs"] == 1 and row["arm"]["steps"] == 9 * 9000
        assert row["fault"] == row["arm"]["fault"]
    kinds = told["kinds"]
    assert [sum(row) >= 1 for row in kinds["counts"]] == [True] * 9
    assert "Kinds told apart" in page.read_text()
    assert "1 friction increase" in done.stderr and "healthy runs alarm" in done.stderr


def test_a_seed_below_zero_is_refused() -> None:
    done = CliRunner().invoke(app, ["bench", "faults", "--lives", "12", "--seed", "-1"])
    assert done.exit_code == 2 and "--seed" in done.stderr


@pytest.mark.parametrize("bench", ["faults", "diagnose", "track"])
def test_a_page_without_a_folder_is_refused_before_anything_is_computed(
    tmp_path: Path, bench: str
) -> None:
    page = tmp_path / "none" / "page.html"
    done = CliRunner().invoke(app, ["bench", bench, "--out", str(page)])
    assert done.exit_code == 1
    assert "folder does not exist" in done.stderr
