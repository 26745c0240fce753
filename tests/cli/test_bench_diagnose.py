"""The bench of kinds: how trials are counted; what it is told of faults is tested elsewhere."""

from __future__ import annotations

import numpy as np
from story import urdyn

from urdyn.cli.bench_diagnose import _missed, _right
from urdyn.cli.diagnosis_trials import Trial, counted, named

GAP, PUSH = ("joint_backlash", 5), ("collision", 4)
TRIALS = [
    Trial((), (), (), None),
    Trial((GAP,), (), (), None, hidden=(GAP,)),
    Trial((GAP,), (GAP,), (0.9,), 3.0),
    Trial((PUSH,), (("collision", 5),), (0.7,), 1.0),
]


def test_what_no_motion_shows_is_told_apart_from_what_was_missed() -> None:
    told = _missed(TRIALS)
    assert told.startswith("1 of 3 faults found (1 of the others do not show in their motion)")
    assert "0 of 1 healthy runs alarm" in told


def test_a_finding_is_right_if_kind_and_joint_are() -> None:
    counts, truth, columns = counted(TRIALS)
    assert _right(counts) == (1, 2)
    assert named(TRIALS)["collision"] == [0, 1] and named(TRIALS)["joint_backlash"] == [1, 1]
    assert counts[truth.index("collision"), columns.index("another joint")] == 1
    assert np.sum(counts) == len(TRIALS)


def test_noise_of_no_kind_is_refused_before_anything_is_computed() -> None:
    done = urdyn("bench", "diagnose", "--noise", "pink")
    assert done.returncode == 1
    assert "--noise 'pink': is one of white, real" in done.stderr
    assert "Traceback" not in done.stderr
