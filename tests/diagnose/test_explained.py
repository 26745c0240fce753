"""What a joint showed at once is neither push nor play where its own change explains it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shop import Shop

from urdyn.diagnose.findings.event_finding import of_event
from urdyn.diagnose.findings.explained import RESOLVED, timed, unexplained
from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.finding import Finding
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.space import space

BEGAN, TOLD = (16.0, 20.0), 30.0  # [s]


def _finding(shop: Shop, kind: str, joint: int, onset: float, **evidence: object) -> Finding:
    said = {"force_N": [30.0, 0.0, 0.0], "force_sd_N": [3.0, 3.0, 3.0], "frame": "base"}
    said |= {"strength_N": 30.0, "duration_s": 1.0}
    said |= evidence
    event = Event(kind, joint, onset, onset + 1.5, 30.0, 0.9, said)
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
    assert unexplained([push, change]) == ((push, change) if stays else (change,))
    assert unexplained([push]) == (push,)


@pytest.mark.parametrize(
    ("joint", "at", "evidence", "stays"),
    [(3, 18.0, {"recurs_at": "velocity"}, False), (3, 40.0, {"recurs_at": "current"}, False),
     (3, 12.0, {"recurs_at": "velocity"}, True), (2, 18.0, {"recurs_at": "velocity"}, True),
     (3, 18.0, {}, True)],
)  # fmt: skip
def test_jolts_that_recur_since_friction_has_grown_are_no_play_but_a_gap_that_is_crossed_is(
    shop: Shop, joint: int, at: float, evidence: dict[str, str], stays: bool
) -> None:
    gap = {"half_gap_rad": 1e-3, "reversals": 5, "lasting_s": 0.1} | evidence
    play, change = _finding(shop, "joint_backlash", joint, at, **gap), _change(shop, 3)
    assert unexplained([play, change]) == ((play, change) if stays else (change,))


@pytest.mark.parametrize(
    ("evidence", "severity"),
    [({"recurs_at": "velocity"}, "warning"), ({"recurs_at": "load"}, "critical"), ({}, "critical")],
)
def test_jolts_where_a_joint_reverses_may_be_friction_and_are_never_critical(
    shop: Shop, evidence: dict[str, str], severity: str
) -> None:
    gap = {"half_gap_rad": 30.0, "reversals": 5, "lasting_s": 0.1} | evidence
    finding = _finding(shop, "joint_backlash", 3, 18.0, **gap)
    assert finding.severity == severity
    assert ("friction" in finding.advice) == (severity == "warning")


STEP = Change(
    suspect=0, onset=35.0, shown=(35.0, 35.0), began=(34.1, 35.9), alarm=45.0, confidence=0.99,
    evidence=600.0, size=-0.2, size_sd=0.01, rate=0.0, rate_sd=0.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("at", "alone", "joint", "change", "times"),
    [(34.0, 1, 1, STEP, True), (35.5, 1, 1, STEP, True), (35.0 - 1.1 * RESOLVED, 1, 1, STEP, False),
     (36.5, 1, 1, STEP, False), (34.0, 2, 1, STEP, False), (34.0, None, None, STEP, False),
     (34.0, 1, 1, replace(STEP, rate=0.01), False), (34.0, 1, 1, replace(STEP, older=True), False)],
)  # fmt: skip
def test_a_push_as_which_a_step_was_felt_times_it_and_is_explained_by_it(
    shop: Shop, at: float, alone: int | None, joint: int | None, change: Change, times: bool
) -> None:
    """It was there by then, though the slow tests had no information while it seemed a push."""
    push = _finding(shop, "collision", 5, at, alone=alone)
    later = _finding(shop, "collision", 5, at + 0.1, alone=alone)
    told = timed(change, joint, [later, push])
    if not times:
        assert told is change
        return
    first, last = push.onset_interval_s
    assert told.onset == at and told.began == (min(change.began[0], first), last)
    found = replace(_change(shop, 1), onset_interval_s=told.began, alarm_s=told.alarm)
    assert unexplained([push, later, found]) == (found,)
