"""What the tests of excitation share: one small search."""

from __future__ import annotations

import pytest

from urdyn.identify.excite import Ask, Excitation, excite
from urdyn.model.arm import Arm

SMALL = Ask(duration=8.0, rate=125.0, harmonics=3, restarts=1)


@pytest.fixture(scope="session")
def found(ur10e: Arm) -> Excitation:
    return excite(ur10e, SMALL)
