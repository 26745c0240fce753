"""What the tests of this room share: a virtual arm at work, and its twin."""

from __future__ import annotations

from pathlib import Path

import pytest
from once import fitted
from workshop import Workshop

from urdyn.identify import identify
from urdyn.io import write
from urdyn.model.arm import Arm
from urdyn.signal import condition
from urdyn.simulate import simulate
from urdyn.twin import Twin


@pytest.fixture(scope="session")
def workshop(ur5e: Arm, tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    """A twin of twenty seconds, and fourteen others to track."""
    folder: Path = tmp_path_factory.mktemp("workshop")
    whole = simulate(ur5e, 34.0, 100.0, seed=1)[0]
    first, log = whole.slice(0, 2000), whole.slice(2000)
    fit = fitted("workshop", lambda: identify(ur5e, condition(first)))
    Twin(ur5e, fit).save(folder / "twin.toml")
    write(log, folder / "log.parquet")
    return Workshop(fit, log, folder / "twin.toml", folder / "log.parquet")
