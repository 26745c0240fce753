"""What the tests of this room share: a small sound log as text, and the real recordings."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

HEADER = "timestamp,actual_q_0,actual_q_1,actual_current_0,actual_current_1"


@pytest.fixture
def rows() -> list[str]:
    """Fifty sound data rows at 100 Hz; row n has q_0 = n/1000."""
    return [f"{10 + n / 100:.2f},{n / 1000},0.5,{n % 7},-1.5" for n in range(50)]


@pytest.fixture
def text(rows: list[str]) -> list[str]:
    """The same with its header: line 1 is text[0]."""
    return [HEADER, *rows]


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Folder of real recordings; tests that need it are skipped where nobody named one."""
    if "URDYN_RECORDINGS" not in os.environ:
        pytest.skip("URDYN_RECORDINGS does not name a folder of recordings")
    return Path(os.environ["URDYN_RECORDINGS"])
