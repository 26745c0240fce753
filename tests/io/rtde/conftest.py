"""What the tests of this room share: controllers that end with the test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from rtde_arm import Arm, Start, start_arm


@pytest.fixture
def start() -> Iterator[Start]:
    """start(host, port, generation): a controller to talk to."""
    arms: list[Arm] = []

    def started(*args: str | int, **kwargs: str | int) -> Arm:
        arms.append(start_arm(*args, **kwargs))  # type: ignore[arg-type]
        return arms[-1]

    yield started
    for arm in arms:
        if arm.process.poll() is None:
            arm.kill()
