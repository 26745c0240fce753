"""What speaks against all findings of a run goes before them, and before what to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
from found import FOUND

from urdyn.cli.diagnosing import summed
from urdyn.diagnose import Finding
from urdyn.diagnose.findings.document import findings_document
from urdyn.diagnose.findings.doubt import GAIN
from urdyn.diagnose.kinds.rules_file import read_rules

JOINTS = tuple(f"joint_{j}" for j in range(6))
HOUSE = read_rules()
SICK = replace(FOUND, severity="critical")


def ill(kind: str, count: int, **how: Any) -> list[Finding]:
    """A finding of so many joints, from the base on."""
    return [replace(SICK, kind=kind, joint=j, name=JOINTS[j], **how) for j in range(count)]


def told(findings: Sequence[Finding], restarts: int = 0) -> tuple[str, str, str]:
    """Doubt and advice of findings.json, and what a terminal shows of the run."""
    document = findings_document(findings, JOINTS, [True] * 6, (), {}, {}, HOUSE, restarts)
    shown = summed(document | {"quality": {"compared": [9] * 6}})
    return document.get("doubt", ""), document["recommendation"]["text"], shown


@pytest.mark.parametrize(("count", "most"), [(1, False), (3, False), (4, True), (6, True)])
def test_current_sensors_of_most_joints_do_not_fail_at_once(count: int, most: bool) -> None:
    sensors = [*ill("sensor_fault", count), *ill("sensor_fault", 1)]  # one of them twice
    doubt, advice, shown = told([*sensors, *ill("friction_increase", 6)])
    assert doubt.startswith(f"current sensors of {count} of 6 joints do not fail") == most
    assert advice.startswith("make sure that this is this arm's twin before") == most
    assert "service now" in advice and shown.endswith(f"recommended: {advice}")
    assert shown.startswith(doubt)


@pytest.mark.parametrize(("count", "half"), [(1, False), (2, False), (3, True), (6, True)])
def test_half_an_arm_does_not_wear_out_before_its_first_sample(count: int, half: bool) -> None:
    worn = [replace(f, older=f.joint < count) for f in ill("health_degradation", 6)]
    doubt, advice, _ = told([*worn, *ill("sensor_fault", 1, older=True)])
    assert doubt.startswith(f"{count} of 6 joints are far from this twin") == half
    assert advice.startswith("make sure that this is this arm's twin before") == half


def test_half_an_arm_is_another_though_its_sensors_go_wrong_together() -> None:
    """They are warnings then."""
    pulled = [replace(f, severity="warning", older=True) for f in ill("sensor_fault", 2)]
    doubt, _, _ = told([*pulled, replace(FOUND, severity="critical", joint=4, older=True)])
    assert doubt.startswith("3 of 6 joints are far from this twin")


@pytest.mark.parametrize(("count", "most"), [(3, False), (4, True)])
def test_what_sensors_of_most_joints_do_not_tell_was_lost_on_the_way(
    count: int, most: bool
) -> None:
    silent = [
        replace(f, evidence={"mode": ("dropped", "encoder")[f.joint % 2]})
        for f in ill("sensor_fault", count)
    ]
    doubt, advice, shown = told(silent)
    assert ("the stream has lost their values" in doubt) == most
    assert advice.startswith("see to the recorder and the network before") == most
    assert "this arm's twin" not in shown


@pytest.mark.parametrize(("gain", "turned"), [(-0.9, False), (-1.3, True)])
def test_a_sensor_that_loses_more_than_its_gain_is_a_column_of_something_else(
    gain: float, turned: bool
) -> None:
    doubt, advice, _ = told(ill("sensor_fault", 1, quantity=GAIN, size=gain))
    assert ("another joint's: no gain is off by -130 %" in doubt) == turned
    assert advice.startswith("see to the order and the signs of the columns") == turned


def test_rules_call_that_gain_as_the_doubt_does() -> None:
    assert [kind.finding_kind for kind in read_rules().slow if kind.quantity == GAIN] == [
        "sensor_fault"
    ]


def test_what_was_found_of_one_joint_is_not_doubted() -> None:
    doubt, advice, _ = told(ill("friction_increase", 1))
    assert not doubt and advice.startswith("service now")


@pytest.mark.parametrize(
    ("kind", "restarts", "first"),
    [
        ("friction_increase", 0, False),
        ("friction_increase", 2, True),
        ("sensor_fault", 2, False),  # which says why
        ("controller_instability", 2, False),
    ],
)
def test_nobody_is_told_to_service_an_arm_that_may_be_another(
    kind: str, restarts: int, first: bool
) -> None:
    doubt, advice, _ = told(ill(kind, 1), restarts)
    assert not doubt and advice.startswith("make sure that this is this arm's twin") == first
    assert "service now" in advice
