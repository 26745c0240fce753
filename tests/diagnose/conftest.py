"""What the tests of this room share: an arm and its twin."""

from __future__ import annotations

import pytest
from shop import Shop

from urdyn.identify import Fit
from urdyn.model.arm import Arm
from urdyn.simulate import virtual_arm


@pytest.fixture(scope="session")
def shop(ur5e: Arm, identified: Fit) -> Shop:
    return Shop(virtual_arm(ur5e, 1), identified)
