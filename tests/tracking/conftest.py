"""What the tests of this room share: a virtual arm at work, and its twin."""

from __future__ import annotations

from pathlib import Path

import pytest
from workshop import Workshop

from urdyn.identify import Fit
from urdyn.io import write
from urdyn.model.arm import Arm
from urdyn.simulate import simulate
from urdyn.twin import Twin


@pytest.fixture(scope="session")
def workshop(ur5e: Arm, identified: Fit, tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    """A twin, and fourteen seconds of its arm to track."""
    folder: Path = tmp_path_factory.mktemp("workshop")
    log = simulate(ur5e, 34.0, 100.0, seed=1)[0].slice(2000)
    Twin(ur5e, identified).save(folder / "twin.toml")
    write(log, folder / "log.parquet")
    return Workshop(identified, log, folder / "twin.toml", folder / "log.parquet")
