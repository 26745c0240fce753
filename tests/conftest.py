"""What the tests of every room share: two arms of the library, and the real recordings."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from once import SHARED, fitted, shared
from realarm import COLUMNS, Recorded

from urdyn.identify import Fit, PayloadPrior, Run, identify
from urdyn.io import read
from urdyn.model.arm import Arm, load_arm
from urdyn.signal import condition
from urdyn.simulate import Payload, simulate
from urdyn.types import Log

# Processes share the cores already: threads of their linear algebra would wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# And what one of them has compiled is compiled for all, though a container may say otherwise.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.fixture(scope="session", autouse=True)
def _once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Where what is made once is kept."""
    SHARED[:] = [shared(tmp_path_factory)]


@pytest.fixture(scope="session")
def ur5e() -> Arm:
    return load_arm("ur5e")


@pytest.fixture(scope="session")
def ur10e() -> Arm:
    return load_arm("ur10e")


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Folder of real recordings; tests that need it are skipped where nobody named one."""
    if "URDYN_RECORDINGS" not in os.environ:
        pytest.skip("URDYN_RECORDINGS does not name a folder of recordings")
    return Path(os.environ["URDYN_RECORDINGS"])


@pytest.fixture(scope="session")
def recorded(recordings: Path) -> Recorded:
    """A run of the real UR10e by its name, or some rows of it."""

    def load(name: str, *rows: int) -> Log:
        path = recordings / "ur10e_dynamics" / f"{name}.csv"
        return read(path, columns=COLUMNS, rows=rows or None)

    return load


@pytest.fixture(scope="session")
def real(ur10e: Arm, recorded: Recorded) -> Fit:
    """That arm as half a minute of excitation tells it, gains and all."""
    log = recorded("ur-20_02_10-30sec_12harm", 635, 3510)
    return fitted("real", lambda: identify(ur10e, condition(log)))


@pytest.fixture(scope="session")
def identified(ur5e: Arm) -> Fit:
    """A virtual arm with a payload of known mass, as twelve seconds without and with it tell it."""
    payload = Payload(2.0, np.array([0.0, 0.02, 0.06]))

    def made() -> Fit:
        bare, loaded = (
            condition(simulate(ur5e, 12.0, 100.0, 1, payload=p)[0]) for p in (None, payload)
        )
        return identify(ur5e, bare, loaded=[Run(loaded, PayloadPrior(payload.mass))])

    return fitted("identified", made)
