"""Names are trusted as far as campaigns and company let them be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_recommendation import GROWING

from urdyn.diagnose.rules_file import read_rules
from urdyn.diagnose.trust import ALONE, in_company, trust
from urdyn.errors import InputError


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


@pytest.mark.parametrize("counts", ["[3, 2]", "[1]", "[0.5, 1]", "7"])
def test_counts_that_cannot_be_are_refused(counts: str, tmp_path: Path) -> None:
    path = tmp_path / "plant.toml"
    path.write_text(f"[named]\ncollision = {counts}\n")
    with pytest.raises(InputError, match="collision"):
        read_rules(path)
