"""Estimates beside the truth, where an arm is simulated and the truth is known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from urdyn.identify import Fit
from urdyn.model.drive import LINEAR, UNITS
from urdyn.types import NORMAL90

Truth = Mapping[str, Any]  # what `urdyn.simulate.truth` returns

GIVEN = 1e-3  # relative sd below which a mass was given, not estimated
DRIVE = ("gain", *LINEAR, "presliding_distance")


@dataclass(frozen=True)
class Comparison:
    """One quantity's truth and estimate."""

    owner: str  # joint, link or payload
    quantity: str
    unit: str
    true: float
    estimate: float
    sd: float  # 0: the quantity was given, or its joint's model has no such term

    @property
    def z(self) -> float:
        """Error in standard deviations."""
        return (self.estimate - self.true) / self.sd if self.sd else float("nan")

    @property
    def inside(self) -> bool:
        """Whether the truth lies inside the 90 % interval."""
        return abs(self.z) <= NORMAL90


def compare(fit: Fit, truth: Truth) -> list[Comparison]:
    """Everything that was estimated, beside its truth: drives, masses of links, payload."""
    found = [*_drives(fit, truth), *_masses(fit, truth)]
    return [c for c in found if c.sd > 0.0]


def left_out(fit: Fit, truth: Truth) -> list[Comparison]:
    """Terms that the arm has and its model lacks."""
    return [c for c in _drives(fit, truth) if c.sd == 0.0 and c.estimate == 0.0 != c.true]


def share_inside(comparisons: Sequence[Comparison]) -> float:
    """Share of truths inside their 90 % intervals; NaN if there are none."""
    inside = sum(c.inside for c in comparisons)
    return inside / len(comparisons) if comparisons else float("nan")


def _drives(fit: Fit, truth: Truth) -> Iterator[Comparison]:
    for joint in truth["joints"]:
        for quantity in DRIVE:
            yield _comparison(fit, joint["name"], quantity, UNITS[quantity], joint[quantity])


def _masses(fit: Fit, truth: Truth) -> Iterator[Comparison]:
    for link in truth["links"]:
        yield _comparison(fit, link["name"], "mass", "kg", link["mass"])
    payload = truth.get("payload")
    # A mass that was given is no estimate.
    if payload and fit.payloads and fit.spread("payload_0.mass") > GIVEN * payload["mass"]:
        yield _comparison(fit, "payload_0", "mass", "kg", payload["mass"])


def _comparison(fit: Fit, owner: str, quantity: str, unit: str, true: float) -> Comparison:
    name = f"{owner}.{quantity}"
    return Comparison(owner, quantity, unit, true, fit.value(name), fit.spread(name))
