"""A push that one joint alone felt is none where a change of that joint explains it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shop import Shop

from urdyn.diagnose.event import Event
from urdyn.diagnose.event_finding import of_event
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.own import unpushed
from urdyn.diagnose.rules import read_rules
from urdyn.diagnose.space import space

BEGAN, TOLD = (16.0, 20.0), 30.0  # [s]


def _finding(shop: Shop, kind: str, joint: int, onset: float, **evidence: object) -> Finding:
    said = {"force_N": [30.0, 0.0, 0.0], "strength_N": 30.0, "duration_s": 1.0} | evidence
    event = Event(kind, joint, onset, onset + 1.5, 0.9, 30.0, said)
    return of_event(event, space(shop.fit), read_rules())


def _change(shop: Shop, joint: int) -> Finding:
    sick = _finding(shop, "sensor_fault", joint, BEGAN[0], mode="noisy")
    return replace(sick, kind="friction_increase", onset_interval_s=BEGAN, alarm_s=TOLD)


@pytest.mark.parametrize(
    ("alone", "at", "stays"),
    [(3, 18.0, False), (3, 25.0, False), (3, 12.0, True), (3, 35.0, True), (2, 18.0, True),
     (None, 18.0, True)],
)  # fmt: skip
def test_a_push_is_its_joints_own_from_when_that_may_have_changed_until_it_is_told(
    shop: Shop, alone: int | None, at: float, stays: bool
) -> None:
    push, change = _finding(shop, "collision", 5, at, alone=alone), _change(shop, 3)
    assert unpushed([push, change]) == ((push, change) if stays else (change,))
    assert unpushed([push]) == (push,)
