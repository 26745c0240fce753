"""The bench of kinds: how trials are counted; what it is told of faults is tested elsewhere."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from urdyn.bench.diagnosis_trials import RATE, Trial, counted, named, on_arm
from urdyn.cli.kinds import kinds_table, summed
from urdyn.report.bench.shares import rate_of

GAP, PUSH = ("joint_backlash", 5), ("collision", 4)
TRIALS = [
    Trial((), (), (), ()),
    Trial((GAP,), (), (), (), hidden=(GAP,)),
    Trial((GAP,), (GAP,), (0.9,), (3.0,)),
    Trial((PUSH,), (("collision", 5),), (0.7,), (1.0,)),
]


def test_what_no_motion_shows_is_told_apart_from_what_was_missed() -> None:
    told = summed(TRIALS, counted(TRIALS))
    assert told.startswith("kind and joint right in 1 of 2 findings; 1 of 3 faults found")
    assert "found (1 of the others do not show in their motion);" in told
    assert "0 of 1 healthy runs alarm" in told


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


def test_every_kind_has_room_on_an_ordinary_terminal() -> None:
    console = Console(width=80)
    with console.capture() as said:
        console.print(kinds_table(counted(12 * TRIALS)))
    lines = said.get()
    assert "…" not in lines and "4 controller instability" in lines
    heads = next(line for line in lines.splitlines() if "truth" in line)
    assert all(f" {k} " in heads for k in range(1, 9))
