"""What the tests of this room share."""

from __future__ import annotations

import pytest
from story import Story, urdyn


@pytest.fixture(scope="session")
def story(tmp_path_factory: pytest.TempPathFactory) -> Story:
    """simulate -> identify, once for all tests."""
    folder = tmp_path_factory.mktemp("story")
    log, truth, held_out = folder / "run.csv", folder / "truth.json", folder / "other.parquet"
    arm = ("--robot", "ur10e", "--duration", "12", "--rate", "100", "--seed", "3")
    simulated = urdyn("simulate", *arm, "--out", log, "--truth", truth, "--json")
    again = urdyn("simulate", *arm, "--run", "1", "--out", held_out)
    assert (simulated.returncode, again.returncode) == (0, 0), simulated.stderr + again.stderr
    out = folder / "twin"
    identified = urdyn("identify", log, "--robot", "ur10e", "--out", out, "--json")
    assert identified.returncode == 0, identified.stderr
    return Story(log, truth, held_out, out, simulated, identified)
