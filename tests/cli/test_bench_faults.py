"""The bench of fault detection as a user runs it, with few lives: numbers are tested elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

from story import urdyn


def test_the_paper_is_beside_ours(tmp_path: Path) -> None:
    page = tmp_path / "faults.html"
    done = urdyn("bench", "faults", "--lives", "12", "--json", "--out", str(page))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert {row["fault"] for row in told["faults"]} == {"friction increase", "health degradation"}
    steep = [row for row in told["faults"] if row["ratio"] >= 0.1]
    assert all(r["found"] == 1.0 for r in steep if r["detector"] == "Shiryaev-Roberts")
    assert all(row["lives"] <= 12 for row in told["faults"])
    assert "of 12 runs" in page.read_text()
    assert "82 %" in done.stderr and "Table III" in page.read_text()


def test_a_seed_below_zero_is_refused() -> None:
    done = urdyn("bench", "faults", "--lives", "12", "--seed", "-1")
    assert done.returncode == 2 and "--seed" in done.stderr


def test_a_page_without_a_folder_is_refused_before_anything_is_computed(tmp_path: Path) -> None:
    done = urdyn("bench", "faults", "--out", str(tmp_path / "none" / "page.html"))
    assert done.returncode == 1
    assert "folder does not exist" in done.stderr
