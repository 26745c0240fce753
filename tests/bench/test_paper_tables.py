"""The paper's tables, measured: what the figures mean, on few lives and on histories made up."""

from __future__ import annotations

from dataclasses import asdict, replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rich.console import Console

from urdyn.bench import (
    CONFIGURATIONS,
    GROUPS,
    Followed,
    Tracked,
    follow_friction,
    follow_health,
    groups,
    ramps,
    virtual_run,
)
from urdyn.bench.arm import QUANTITIES
from urdyn.cli.bench_tables import notes, tables
from urdyn.cli.bench_track import _table_1, _table_2
from urdyn.cli.fresh import fresh
from urdyn.report.bench.track import bench_page
from urdyn.simulate.paper import FRICTION_INCREASE, HEALTH_DEGRADATION, reconstruction
from urdyn.types import Log

LIVES = 4
TRUE = {
    "robot": "ur5e",
    "noise": "real",
    "arms": 1,
    "duration_s": 60.0,
    "nis": 0.97,
    "sd": None,
    "groups": [
        {"symbol": "f", "coverage": 0.91, "coverage_low": None, "coverage_high": None}
        | {"ratio": 1.02, "ratio_sd": None, "nees": 1.13, "nees_sd": None, "pass": None}
    ],
}
RATE = 100.0


@pytest.fixture(scope="module")
def friction() -> dict[str, Followed]:
    found = follow_friction(replace(FRICTION_INCREASE, sigma=0.025), LIVES)
    return {f.filter: f for f in found if f.symbol == "f"}


def test_linear_filters_are_one_filter_on_the_papers_scenario(
    friction: dict[str, Followed],
) -> None:
    exact = friction["EKF"].rmse
    assert friction["UKF"].rmse == pytest.approx(exact, rel=1e-6)
    assert friction["VI"].rmse == pytest.approx(exact, rel=1e-6)
    # A thousand drawn from a prior eight readings wide: few are near the truth, and chance decides.
    assert 0.9 * exact < friction["PF (1k particles)"].rmse < 2.0 * exact


def test_what_knows_of_ramps_is_nearer_the_bound_than_a_walk(
    friction: dict[str, Followed],
) -> None:
    assert friction["bank"].ratio < 1.3 < friction["EKF"].ratio


def test_health_is_followed_down() -> None:
    (found,) = follow_health(replace(HEALTH_DEGRADATION, sigma=0.025), LIVES)
    assert found.symbol == "z" and found.ratio < 1.4
    assert found.rmse < 0.125  # the paper's


def test_the_papers_filter_is_as_low_on_ramps_as_the_paper_says() -> None:
    found = ramps(0.025, LIVES)
    assert found.paper_bias == pytest.approx(-0.028, abs=0.002)
    assert abs(found.late_bias) < 0.1 * abs(found.paper_bias)
    assert found.bound < found.bound_onset


@pytest.fixture
def made_up(tmp_path: Path) -> Tracked:
    """A history whose errors are 1 in its first half and 0.1 in its second; bounds are 0.2."""
    return _made_up(tmp_path, 0.1)


def _made_up(folder: Path, late: float) -> Tracked:
    """Of a truth that moves: what is told of it is wrong by 1, then by `late`."""
    t, names = np.arange(0.0, 10.0, 0.5), [f"a.{quantity}" for quantity, _ in QUANTITIES.values()]
    error = np.where(t > 0.5 * t[-1], late, 1.0)
    cells = {"t": t} | dict.fromkeys(names, 0.5 + 0.01 * t + error)
    cells |= {f"{name}.sd": np.full(len(t), 0.2) for name in names}
    pq.write_table(pa.table(cells), folder / "history.parquet")
    ends = np.array([0.0, 10.0])
    truth = Log(ends, dict.fromkeys(names, 0.5 + 0.01 * ends))
    return Tracked(truth, folder / "history.parquet", folder / "history.parquet")


def test_errors_of_an_arm_are_those_of_the_second_half(made_up: Tracked) -> None:
    for group in groups([made_up]):
        assert group.rmse == pytest.approx(0.1)
        assert group.ratio == pytest.approx(0.5) and group.ratio_sd is None
        assert group.converged == 5.0  # first stamp of the second half


def test_errors_of_arms_are_a_mean_of_squares_and_its_scatter(
    made_up: Tracked, tmp_path: Path
) -> None:
    (other := tmp_path / "other").mkdir()
    for group in groups([made_up, _made_up(other, 0.7)]):
        assert group.rmse == pytest.approx(0.5)  # of .01 and .49
        assert group.ratio == pytest.approx(2.5)
        # Squares over the bound's are .25 and 12.25: their mean is known to 6, its root to 1.2.
        assert group.ratio_sd == pytest.approx(1.2)


@pytest.fixture
def document(friction: dict[str, Followed], made_up: Tracked) -> dict[str, Any]:
    arm = {g.symbol: asdict(g) | {"ratio": g.ratio} for g in groups([made_up])}
    pace = {"hz": 1234.0, "p50_ms": 0.8, "p99_ms": 0.9, "mb": 140.0}
    names = [name for name in friction if name != "bank"]
    found = ramps(0.025, LIVES)
    return {
        "urdyn": "0",
        "reconstruction": reconstruction(FRICTION_INCREASE),
        "arm": {"robot": "ur10e", "arms": 1, "duration_s": 10.0, "rate_hz": 100.0},
        "ramps": [asdict(found) | {"ratio": found.ratio, "pass": True}],
        "table_1": _table_1({0.05: list(friction.values())}, arm),
        "table_2": _table_2(
            list(friction.values()), dict.fromkeys(names, arm), dict.fromkeys(names, pace)
        ),
        "table_4": [
            asdict(c)
            | {"ours": pace if c.mode == "full" else None}
            | {"accuracy": arm["f"] if c.mode == "full" else None}
            for c in CONFIGURATIONS
        ],
        "truth": [TRUE],
    }


def test_every_figure_of_the_paper_is_beside_ours(document: dict[str, Any]) -> None:
    console = Console(width=120, file=StringIO(), record=True)
    console.print(*tables(document), *notes(document))
    told = console.export_text()
    for figure in ("0.187", "247", "48.2", "1234", "not there yet", "1.13", "0.97"):
        assert figure in told, figure
    assert all(group.comparable.split(",")[0] in told for group in GROUPS)


def test_the_page_holds_the_figures_and_asks_nobody_for_anything(document: dict[str, Any]) -> None:
    page = bench_page(document)
    for figure in ("0.187", "48.2", "1234 Hz", "140 MB", "eq. 7", "0.91"):
        assert figure in page, figure
    assert "<script src" not in page and "<link" not in page


@pytest.mark.slow
def test_a_virtual_arm_is_followed_better_than_the_paper_where_units_agree(tmp_path: Path) -> None:
    arm = virtual_run(tmp_path, 8.0, RATE)
    fresh("track", str(arm.twin), str(arm.log), "--out", f"{tmp_path}/ekf", "--filter", "ekf")
    history = tmp_path / "ekf" / "history.parquet"
    found = {group.symbol: group for group in groups([Tracked(arm.truth, history, history)])}
    paper = {group.symbol: group.rmse for group in GROUPS}
    for symbol in ("k", "beta", "z"):
        assert found[symbol].rmse < paper[symbol]
