"""One identified arm for all pages: simulated, so that the truth is known. One browser."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import pytest
from browser import CHROMIUM, Browser, browser

from urdyn.identify import Fit, Score, validate
from urdyn.simulate import simulate
from urdyn.types import Source


@dataclass(frozen=True)
class Case:
    fit: Fit
    seen: Score
    unseen: Score
    truth: Mapping[str, Any]

    @property
    def scores(self) -> list[Score]:
        return [self.seen, self.unseen]


@pytest.fixture(scope="session")
def case(identified: Fit) -> Case:
    log, truth = simulate(identified.dynamics.arm, 20, 100, seed=1)
    log = replace(log, source=Source("robots/first.csv", "ab" * 32, (0, 1500)))
    train, test = log.slice(0, 1500), log.slice(1500)
    fit = replace(identified, sources=(train.source,))
    return Case(fit, validate(fit, train), validate(fit, test), truth)


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with browser(tmp_path_factory.mktemp("chromium") / "profile") as one:
        yield one
