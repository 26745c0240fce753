"""What the tests of this room share: a simulated log, and the twin that was identified from it."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def urdyn(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return subprocess.run(
        (sys.executable, "-m", "urdyn", *map(str, arguments)),
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": path} | environment,
        check=False,
    )


@dataclass(frozen=True)
class Story:
    """A simulated arm, its log and its identification."""

    log: Path
    truth: Path
    held_out: Path
    out: Path  # twin.toml, identified.urdf, report.html
    simulated: subprocess.CompletedProcess[str]
    identified: subprocess.CompletedProcess[str]


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
