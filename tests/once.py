"""What takes long to make is made once, though tests are shared out among processes."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from urdyn.identify import Fit
from urdyn.twin import Twin


def shared(factory: pytest.TempPathFactory) -> Path:
    """A folder of this run of the tests, the same for every process of it."""
    folder = factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


def fitted(name: str, make: Callable[[], Fit], factory: pytest.TempPathFactory) -> Fit:
    """A fit that whoever comes first makes; a twin's file reads back as the twin it was."""
    path = shared(factory) / f"{name}.toml"
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.exists():
            fit = make()
            Twin(fit.dynamics.arm, fit).save(path)
    return Twin.load(path).fit
