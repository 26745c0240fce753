"""A verb in a process of its own: its words, its memory and not ours, and its failure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from urdyn.cli.fresh import fresh
from urdyn.errors import UrdynError


def test_memory_is_that_of_the_verb_and_not_of_who_asked(tmp_path: Path) -> None:
    ballast = np.ones(80_000_000)  # 640 MB here
    how = ("--robot", "ur5e", "--duration", "1", "--rate", "50", "--out", f"{tmp_path}/a.csv")
    took = fresh("simulate", *how, "--json")
    assert json.loads(took.said)
    assert 20e6 < took.rss < 0.8 * ballast.nbytes
    assert 0.1 < took.wall < 60.0


def test_what_a_verb_complains_of_is_told(tmp_path: Path) -> None:
    with pytest.raises(UrdynError, match=r"urdyn validate: .*nothing\.toml"):
        fresh("validate", f"{tmp_path}/nothing.toml", f"{tmp_path}/nothing.csv")
