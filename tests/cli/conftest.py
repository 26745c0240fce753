"""What the tests of this room share."""

from __future__ import annotations

from pathlib import Path

import pytest
from once import filled
from story import Story, kept, told, urdyn


def _told(folder: Path) -> None:
    """simulate -> identify."""
    log, truth, held_out = folder / "run.csv", folder / "truth.json", folder / "other.parquet"
    arm = ("--robot", "ur10e", "--duration", "12", "--rate", "100", "--seed", "3")
    simulated = urdyn("simulate", *arm, "--out", log, "--truth", truth, "--json")
    again = urdyn("simulate", *arm, "--run", "1", "--out", held_out)
    assert (simulated.returncode, again.returncode) == (0, 0), simulated.stderr + again.stderr
    identified = urdyn("identify", log, "--robot", "ur10e", "--out", folder / "twin", "--json")
    assert identified.returncode == 0, identified.stderr
    kept(folder / "simulated.json", simulated)
    kept(folder / "identified.json", identified)


@pytest.fixture(scope="session")
def story() -> Story:
    """It is told once for all tests."""
    folder = filled("story", _told)
    log, truth, held_out = folder / "run.csv", folder / "truth.json", folder / "other.parquet"
    said = (told(folder / f"{what}.json") for what in ("simulated", "identified"))
    return Story(log, truth, held_out, folder / "twin", *said)
