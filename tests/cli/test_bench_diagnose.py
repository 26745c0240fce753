"""The bench of kinds: how trials are counted; what it is told of faults is tested elsewhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from urdyn.bench import diagnosis_trials
from urdyn.bench.diagnosis_trials import (
    NOTHING,
    ONSET,
    PROBED,
    RATE,
    Trial,
    counted,
    named,
    on_arm,
    reliability,
    trials,
)
from urdyn.cli.kinds import kinds_table, summed
from urdyn.diagnose.slow.slow import BLOCK
from urdyn.model.arm import load_arm
from urdyn.report.bench.shares import rate_of
from urdyn.simulate import typical_sensors, virtual_arm

GAP, PUSH = ("joint_backlash", 5), ("collision", 4)
TRIALS = [
    Trial((), (), (), ()),
    Trial((GAP,), (), (), (), hidden=(GAP,)),
    Trial((GAP,), (GAP,), (0.9,), (3.0,), held=(True,)),
    Trial((PUSH,), (("collision", 5),), (0.7,), (1.0,)),
]


def test_what_no_motion_shows_is_told_apart_from_what_was_missed() -> None:
    told = summed(TRIALS, counted(TRIALS))
    assert told.startswith("kind and joint right in 1 of 2 findings; 1 of 3 faults found")
    assert "found (1 of the others do not show in their motion);" in told
    assert "0 of 1 healthy runs alarm" in told
    assert told.endswith("; 1 of 1 onsets are within their 90 % intervals")


def test_a_finding_is_right_if_kind_and_joint_are() -> None:
    kinds = counted(TRIALS)
    counts, truth, columns = kinds.counts, kinds.truth, kinds.told
    assert (kinds.right, kinds.findings) == (1, 2)
    assert named(TRIALS)["collision"] == [0, 1] and named(TRIALS)["joint_backlash"] == [1, 1]
    assert counts[truth.index("collision"), columns.index("another joint")] == 1
    assert np.sum(counts) == len(TRIALS)


def test_a_row_of_table_3_is_what_came_of_its_kind() -> None:
    gap, push = (on_arm(TRIALS, kind, kind) for kind in ("joint_backlash", "collision"))
    assert (gap.found, gap.runs, gap.hidden, gap.false) == (0.5, 2, 1, 0)
    assert (gap.delay_s, gap.delay, gap.sure) == (3.0, 3.0 * RATE, 0.9)
    assert (push.found, push.runs, push.false) == (0.0, 1, 1)
    assert np.isnan(push.delay_s) and push.false_per_1000 == 1000.0 / push.steps
    assert rate_of(push.false, push.steps).startswith(f"{push.false_per_1000:.2g} (")


def test_a_trial_keeps_all_findings_in_the_order_of_alarm(monkeypatch: pytest.MonkeyPatch) -> None:
    alarms = {50.0: GAP, 31.0: GAP, 40.0: PUSH}
    found = [
        SimpleNamespace(
            kind=kind, joint=joint, confidence=0.5, alarm_s=alarm, onset_interval_s=(0.0, alarm)
        )
        for alarm, (kind, joint) in alarms.items()
    ]
    report = SimpleNamespace(findings=found, document={"observability": {PROBED: []}})
    monkeypatch.setattr(diagnosis_trials, "diagnose", lambda *_: report)
    monkeypatch.setattr(diagnosis_trials, "DURATION", 2.0)
    arm = load_arm("ur10e")
    (trial,) = trials(virtual_arm(arm, 0), None, typical_sensors(arm), 1, 0, ((),))
    assert trial.told == (GAP, PUSH, GAP)
    onset = 31.0 - trial.delays[0]
    assert ONSET < onset < ONSET + BLOCK
    assert trial.delays == (31.0 - onset, 40.0 - onset, 50.0 - onset)
    assert trial.held == (onset <= 31.0, True, True)


def test_a_pair_of_kinds_may_befall_one_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    none = SimpleNamespace(findings=[], document={"observability": {PROBED: []}})
    monkeypatch.setattr(diagnosis_trials, "diagnose", lambda *_: none)
    monkeypatch.setattr(diagnosis_trials, "DURATION", 2.0)
    arm = load_arm("ur10e")
    sets = (("friction_increase", "health_degradation"), ("friction_increase+health_degradation",))
    apart, alike = trials(virtual_arm(arm, 0), None, typical_sensors(arm), 1, 0, sets)
    for trial, joints in ((apart, 2), (alike, 1)):
        assert [kind for kind, _ in trial.truth] == list(sets[0])
        assert len({joint for _, joint in trial.truth}) == joints


def test_every_kind_has_room_on_an_ordinary_terminal() -> None:
    console = Console(width=80)
    with console.capture() as said:
        console.print(kinds_table(counted(12 * TRIALS)))
    lines = said.get()
    assert "…" not in lines and "4 controller instability" in lines
    heads = next(line for line in lines.splitlines() if "truth" in line)
    assert all(f" {k} " in heads for k in range(1, 9))


def test_a_fault_is_found_by_the_first_finding_since_it_is_there() -> None:
    """What is told before, and again, is wrong: it counts as such, and hides no missed fault."""
    worn, swap = ("friction_increase", 2), ("sensor_fault", 2)
    done = [
        Trial(
            (GAP,), (GAP, GAP, GAP), (0.6, 0.9, 0.7), (-5.0, 3.0, 20.0), held=(False, True, True)
        ),
        Trial((GAP,), (GAP,), (0.6,), (-5.0,), held=(True,)),
        Trial(
            (GAP, worn),
            (swap, worn, worn, PUSH),
            (0.6,) * 4,
            (-2.0, 1.0, 9.0, 12.0),
            held=(True, False, True, True),
        ),
    ]
    assert [t.right for t in done] == [False, False, False]
    assert [t.delay for t in done] == [3.0, None, 1.0]
    assert named(done)["joint_backlash"] == [1, 4]
    assert sum(round(share * n) for _, share, n in reliability(done)) == 2
    gap = on_arm(done, "joint_backlash", "joint backlash")
    assert (gap.delay_s, gap.sure, gap.false) == (3.0, 0.9, 3)
    assert gap.found == pytest.approx(1 / 3)
    kinds = counted(done)
    assert (kinds.right, kinds.findings) == (2, 8)
    said = {
        (kinds.truth[i], kinds.told[j]): int(kinds.counts[i, j])
        for i, j in np.argwhere(kinds.counts)
    }
    assert said == {
        (GAP[0], GAP[0]): 1,
        (GAP[0], NOTHING): 1,
        (GAP[0], PUSH[0]): 1,
        (worn[0], worn[0]): 1,
        (NOTHING, GAP[0]): 3,
        (NOTHING, worn[0]): 1,
        (NOTHING, swap[0]): 1,
    }
    assert summed(done, kinds).startswith("kind and joint right in 2 of 8 findings; 2 of 4 faults")
    assert summed(done, kinds).endswith("; 1 of 2 onsets are within their 90 % intervals")
