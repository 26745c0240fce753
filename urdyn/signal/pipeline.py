"""Pipelines: what happens to a log before inference, with every stage open to inspection."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from urdyn.signal.features import add_features
from urdyn.signal.normalise import normalise
from urdyn.signal.outliers import reject_outliers
from urdyn.signal.smooth import smooth
from urdyn.signal.synchronise import synchronise
from urdyn.types import Log

Stage = Callable[[Log], Log]


@dataclass(frozen=True)
class Run:
    """What a pipeline made of one log: the raw log and the result of every stage, in order."""

    stages: tuple[tuple[str, Log], ...]

    def __getitem__(self, name: str) -> Log:
        return dict(self.stages)[name]

    @property
    def result(self) -> Log:
        """What the last stage left; its `defects` list what all of them did."""
        return self.stages[-1][1]


@dataclass(frozen=True)
class Pipeline:
    """Named stages, each from Log to Log; a stage's settings are bound with functools.partial."""

    stages: tuple[tuple[str, Stage], ...] = ()

    def run(self, log: Log) -> Run:
        """Every stage of one log, beginning with "raw"."""
        done = [("raw", log)]
        for name, stage in self.stages:
            done.append((name, stage(done[-1][1])))
        return Run(tuple(done))


PAPER = Pipeline(
    (
        ("filter", smooth),
        ("synchronise", synchronise),
        ("outliers", reject_outliers),
        ("features", add_features),
        ("normalise", normalise),
    )
)
"""Section IV.B with its settings, for its figures: what it filters cannot carry a likelihood.

No verb runs it: `condition` takes the log as the robot gave it.
"""
