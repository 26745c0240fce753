"""On recordings of a real arm: pushes by hand are collisions, healthy days raise nothing."""

from __future__ import annotations

import pytest
from realarm import Recorded, grown, worn

from urdyn.diagnose import Diagnosis, diagnose
from urdyn.diagnose.state import Now
from urdyn.identify import Fit
from urdyn.signal import condition, samples
from urdyn.tracking import Tracker
from urdyn.tracking.belief.blocks import Blocks

LIVE = {
    "ur-20_02_06-20sec_10harm": [],
    "ur-20_02_05-20sec_12harm": [],
    "ur-20_02_19_15harm50secLoad": ["payload_change"],  # whose currents drop once, for .15 s
}
HEALTHY = (
    "ur-20_02_12-40sec_12harm",
    "ur-20_02_10-20sec_7harm",
    "ur-20_01_22-joint_2",
    "ur-20_01_17-p1",
)


@pytest.mark.slow
def test_pushes_by_hand_are_collisions_and_nothing_else(real: Fit, recorded: Recorded) -> None:
    """Of four, on an arm that stands, all but one that is less than the first joint's friction."""
    found = diagnose(real, recorded("ur-20_01_22-push_pose_1"))
    assert [(f.kind, round(f.onset_s)) for f in found] == [
        ("collision", onset) for onset in (205, 209, 213)
    ]


@pytest.mark.slow
def test_a_loaded_run_is_a_payload_with_its_mass(real: Fit, recorded: Recorded) -> None:
    (found,) = diagnose(real, recorded("ur-20_02_19_15harm50secLoad"))
    assert found.kind == "payload_change"
    # Without a known payload the gains keep most of their prior of 10 %, and masses inherit it.
    assert abs(found.size / 2.805 - 1.0) < 0.2
    gain_sd = min(
        real.belief.sd[real.names.index(f"{j}.gain")] for j in real.dynamics.arm.joint_names
    )
    assert found.size_sd >= gain_sd * found.size > 0.02 * found.size
    assert abs(found.size - 2.805) < 2.6 * found.size_sd  # once in a hundred


@pytest.mark.slow
@pytest.mark.parametrize("name", HEALTHY)
def test_healthy_days_raise_nothing(real: Fit, recorded: Recorded, name: str) -> None:
    assert len(diagnose(real, recorded(name))) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", LIVE)
def test_healthy_days_raise_nothing_and_a_load_itself_alone_sample_by_sample(
    real: Fit, recorded: Recorded, name: str
) -> None:
    """A live twin knows no future: its accelerations are noisier, above all where an arm brakes."""
    log = recorded(name)
    tracker, diagnosis = Tracker(real, Blocks(8), 0.01), Diagnosis(real, 0.01)
    state, belief = diagnosis.init(), tracker.init()
    for sample in samples(log):
        belief, reading = tracker.step(belief, sample)
        if reading is not None:
            now = Now(reading.instant, reading.inputs.s, reading.travelled)
            state, _ = diagnosis.step(state, now)
    state, _ = diagnosis.finish(state)
    assert [f.kind for f in state.findings] == LIVE[name]


@pytest.mark.slow
@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("begins", ["before", "within"])
def test_friction_that_was_put_into_a_recording_is_found(
    real: Fit, recorded: Recorded, joint: int, begins: str
) -> None:
    """By a half, from the first row on: it wore since commissioning. Or while it is recorded."""
    log = recorded("ur-20_02_19_15harm50sec")
    since = log.t[0] if begins == "before" else log.t[0] + 20.0
    found = diagnose(real, worn(log, real.dynamics, joint, 0.5, since)).findings
    if (joint, begins) == (5, "before") and not found:
        pytest.xfail("15.5 nats of the 19.3 that the promise asks for: a last wrist's day is wide")
    assert [(f.kind, f.joint) for f in found] == [("friction_increase", joint)]
    assert found[0].older == ("s or before" in found[0].text) == (begins == "before")
    motion = condition(log, offset=real.dynamics.drive.time_offset)
    more = grown(motion, real.dynamics, joint, 0.5, 0.5, since)
    assert abs(found[0].size - more) < 2.6 * found[0].size_sd < 0.3  # once in a hundred
