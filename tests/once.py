"""What takes long to make is made once, though tests are shared out among processes."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from urdyn.identify import Fit
from urdyn.twin import Twin

SHARED: list[Path] = []  # the folder of this run of the tests, once it is known


def shared(factory: pytest.TempPathFactory) -> Path:
    """A folder of this run of the tests, the same for every process of it."""
    folder = factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


def filled(name: str, fill: Callable[[Path], None]) -> Path:
    """A folder that whoever comes first fills; where that failed, the next one tries."""
    folder = SHARED[0] / name
    done = folder.with_suffix(".done")
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            fill(folder)
            done.touch()
    return folder


def fitted(name: str, make: Callable[[], Fit]) -> Fit:
    """A fit that whoever comes first makes; a twin's file reads back as the twin it was."""

    def fill(folder: Path) -> None:
        fit = make()
        Twin(fit.dynamics.arm, fit).save(folder / "twin.toml")

    return Twin.load(filled(name, fill) / "twin.toml").fit
