"""Names are trusted as far as campaigns and company let them be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_recommendation import GROWING

from urdyn.diagnose.findings.ledger import entered
from urdyn.diagnose.findings.recommend import recommendation
from urdyn.diagnose.findings.trust import ALONE, AT_ONCE, in_company, trust
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.errors import InputError
from urdyn.faults import Costs


def test_trust_is_what_was_right_once_enough_was_seen() -> None:
    rng, p = np.random.default_rng(0), {"often": 0.95, "seldom": 0.6}
    named = {kind: [int(rng.binomial(2000, x)), 2000] for kind, x in p.items()}
    for kind, right in p.items():
        # 2000 draws have an sd of .011 at most; five findings of the others' move it by .001
        assert abs(trust(kind, named) - right) < 0.035
    assert trust("new", named) == pytest.approx(0.775, abs=0.035)
    assert trust("new", {}) == 0.5


def test_of_many_findings_at_once_two_are_expected_to_be_right() -> None:
    alone = replace(GROWING, confidence=0.96)
    assert [f.confidence for f in in_company([alone])] == [0.96]
    pair = [alone, replace(alone, id="b", alarm_s=alone.alarm_s + 30.0)]
    assert [f.confidence for f in in_company(pair)] == [0.96, 0.96]
    many = in_company([replace(alone, id=str(k)) for k in range(8)])
    assert sum(f.confidence for f in many) == pytest.approx(2 * 0.96)
    later = replace(alone, id="later", alarm_s=alone.alarm_s + 600.0)
    again = in_company([*many, later])  # what was told is told again, no less
    assert [f.confidence for f in again] == [f.confidence for f in many] + [0.96]
    assert {f.evidence[ALONE] for f in again} == {0.96}
    assert all(told is had for told, had in zip(again, many, strict=False))  # a day has hundreds


def test_a_current_sensor_that_goes_wrong_in_company_is_no_service_before_a_pull_is_ruled_out() -> (
    None
):
    slow = replace(GROWING, severity="critical", kind="sensor_fault", evidence={"rivals": []})
    bias, zero = replace(slow, id="bias"), replace(slow, id="zero", kind="encoder_offset")
    gain, worn = replace(slow, id="gain"), replace(slow, id="worn", kind="friction_increase")
    stuck = replace(slow, id="stuck", evidence={"mode": "stuck"})
    later = replace(gain, alarm_s=slow.alarm_s + AT_ONCE)
    for others in ([], [worn], [stuck], [later], [replace(gain, gone=True)]):  # one sensor's fault
        assert {f.severity for f in entered((), [bias, *others])[0]} == {"critical"}
    assert {f.severity for f in entered((), [zero, replace(zero, id="other")])[0]} == {"critical"}
    told = {f.id: f for f in entered((), [bias, gain, zero, worn, stuck])[0]}
    assert {name for name, f in told.items() if f.severity == "critical"} == {"worn", "stuck"}
    assert {name for name, f in told.items() if "hose" in f.advice} == {"bias", "gain", "zero"}
    retold = entered((bias, worn), [gain])[1]
    assert {f.id: f.severity for f in retold} == {"bias": "warning", "gain": "warning"}
    said = recommendation([told["bias"], told["gain"]], Costs())
    assert said["advice"] == "never" and "hose" in said["text"]


@pytest.mark.parametrize("counts", ["[3, 2]", "[1]", "[0.5, 1]", "7"])
def test_counts_that_cannot_be_are_refused(counts: str, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(f"[named]\ncollision = {counts}\n")
    with pytest.raises(InputError, match="collision"):
        read_rules(path)
