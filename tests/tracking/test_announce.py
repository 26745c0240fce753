"""Who listens to a run hears what it believes, how sure that is, and when nothing comes."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from urdyn.io.bags import joints
from urdyn.io.ros2.compose import Types
from urdyn.io.ros2.talk import Voice
from urdyn.io.seen import acknowledged, forgetting, seen
from urdyn.io.snapshot import Snapshot
from urdyn.io.status import Level, Status, of_finding
from urdyn.signal import samples
from urdyn.tracking import Arrival, open_source
from urdyn.tracking.output import announce, history_row
from urdyn.tracking.output.announce import Announcer, Audience, by_part
from urdyn.tracking.output.statuses import FRICTION, HEALTH, limited, stale, statuses
from urdyn.tracking.sources.source import now

JOINTS = ("shoulder_pan_joint", "elbow_joint")
FINDING = {
    "kind": "friction_increase",
    "joint": 1,  # of the arm's own
    "alarm_s": 3.0,
    "severity": "warning",
    "time_to_failure_s": {"median": 600.0, "lo": 300.0, "hi": 900.0},
}


def snapshot(friction: float = 3.0, health: float = 1.0, sd: float = 1e-3) -> Snapshot:
    mean = {joint: {"friction": 3.0, "health": 1.0} for joint in JOINTS}
    mean["elbow_joint"] = {"friction": friction, "health": health}
    spread = {joint: {"friction": sd, "health": sd} for joint in JOINTS}
    units = {"friction": "N·m", "health": "-", "mass": "kg"}
    nothing = np.zeros(2)
    return Snapshot(
        "ur5e",
        0,
        1,
        JOINTS,
        mean | {"payload": {"mass": 1.0}},
        spread | {"payload": {"mass": 0.1}},
        units,
        nothing,
        nothing,
        np.zeros(3),
        np.ones((2, 2)),
    )


JOINT_NAMES = joints.JOINTS
THREE = np.array([3.0, 3.0])


@pytest.mark.parametrize("grade", [Level.WARN, Level.ERROR])
def test_a_limit_counts_once_it_is_surely_crossed(grade):
    surely = [snapshot(3.0 * FRICTION[grade] + 0.1), snapshot(health=HEALTH[grade] - 0.01)]
    for one in surely:
        pan, elbow, arm = statuses(one, THREE)
        assert (pan.level, elbow.level, arm.level) == (Level.OK, grade, grade)
        assert "elbow_joint" in arm.message
        unsure = replace(one, sd={part: dict.fromkeys(v, 9.0) for part, v in one.sd.items()})
        assert statuses(unsure, THREE)[1].level == Level.OK


def test_an_interval_holds_ninety_per_cent_as_everywhere():
    pan, _, _ = statuses(snapshot(sd=0.172), THREE)
    assert dict(pan.values)["friction"] == "3 ± 0.28 N·m"  # 1.645 sd


def test_findings_are_lines_of_their_joints():
    _, elbow, arm = statuses(snapshot(), THREE, [FINDING], "20235")
    assert elbow.level == arm.level == Level.WARN
    assert elbow.message == "friction increase, 10 min left" and elbow.hardware_id == "20235"
    assert ("kind", "friction_increase") in elbow.values
    over = FINDING | {"time_to_failure_s": {"median": -1.0}}
    assert (
        of_finding(over).level
        == of_finding(FINDING | {"severity": "critical"}).level
        == Level.ERROR
    )
    assert of_finding({"kind": "collision", "joint": None}).name == "urdyn: arm"
    known = of_finding(over | {"acknowledged": True})
    assert known.level == Level.OK
    assert known.message == "acknowledged: friction increase, time is over"


@pytest.mark.parametrize(("joint", "name"), [(1, "urdyn: elbow_joint"), (None, "urdyn: arm")])
def test_what_was_acknowledged_in_a_run_s_folder_is_still_told(joint, name):
    known = FINDING | {"joint": joint, "acknowledged": True}
    lines = statuses(snapshot(), THREE, [FINDING | {"joint": 0, "gone": True}, known])
    said = {line.name: (line.level, line.message) for line in lines}
    message = "acknowledged: friction increase, 10 min left"
    if joint is not None:
        assert said[name] == (Level.OK, message)
    assert said["urdyn: arm"] == (Level.OK, f"{name}: {message}")
    assert said["urdyn: shoulder_pan_joint"] == (Level.OK, "as commissioned")


def test_what_is_over_is_no_error_and_what_is_gone_no_warning():
    grave = FINDING | {"severity": "critical", "gone": True}
    assert of_finding(grave).level == Level.OK
    assert of_finding(grave).message == "gone by now: friction increase, 10 min left"
    *_, arm = statuses(snapshot(), THREE, [grave])
    assert (arm.level, arm.message) == (Level.OK, "as commissioned")
    push = grave | {"kind": "collision", "gone": False, "time_to_failure_s": None}
    well = push | {"kind": "sensor_fault", "evidence": {"until_s": 9.0}}
    assert of_finding(push).level == of_finding(well).level == Level.WARN
    assert of_finding(well | {"evidence": {}}).level == Level.ERROR


def test_what_is_acknowledged_is_told_and_no_longer_warned_of():
    lines = statuses(snapshot(), THREE, [FINDING])
    some = acknowledged(lines, seen(lines, ["urdyn: elbow_joint"]))
    assert [s.level for s in some] == [Level.OK, Level.OK, Level.WARN]
    assert "friction increase" in some[1].message
    sooner = FINDING | {"time_to_failure_s": {"median": 500.0, "lo": 200.0, "hi": 700.0}}
    for still in (lines, statuses(snapshot(), THREE, [sooner])):
        assert {s.level for s in acknowledged(still, seen(lines, [""]))} == {Level.OK}
    assert {s.level for s in stale(lines, 3.0)} == {Level.STALE}


def test_what_speaks_against_all_findings_is_the_arm_s_line():
    lines = statuses(snapshot(), THREE, [FINDING])
    *parts, arm = limited(lines, "this is not this arm's twin", "")
    assert tuple(parts) == lines[:-1] and arm.level == lines[-1].level
    assert arm.message == f"this is not this arm's twin; {lines[-1].message}"
    well = statuses(snapshot(), THREE)
    assert limited(well, "nothing is left of it", "") == well and limited(lines, "", "") == lines


COLLISION = FINDING | {"kind": "collision", "id": "collision.elbow_joint@9.0"}
AGAIN = COLLISION | {"id": "collision.elbow_joint@12.0"}


@pytest.mark.parametrize(
    ("before", "after"),
    {
        "worse": ([FINDING], [FINDING | {"severity": "critical"}]),
        "something else": ([FINDING], [FINDING, COLLISION]),
        "once more": ([COLLISION], [COLLISION, AGAIN]),
        "another joint": ([FINDING], [FINDING, FINDING | {"joint": 0}]),
        "the arm itself": ([FINDING], [FINDING, COLLISION | {"joint": None}]),
        "nothing was the matter then": ([], [FINDING]),
    }.values(),
)
def test_what_gets_worse_or_is_new_is_warned_of_again(before, after):
    known = seen(statuses(snapshot(), THREE, before), [""])
    lines = statuses(snapshot(), THREE, after)
    *parts, arm = acknowledged(lines, known)
    worst = max(s.level for s in lines)
    assert arm.level == worst
    told = {s.name for s in parts if s.level == worst}
    assert not told or any(name in arm.message for name in told)


def test_what_was_acknowledged_and_is_gone_is_warned_of_again_if_it_returns():
    other = FINDING | {"joint": 0}
    lines = statuses(snapshot(), THREE, [other, FINDING])
    known = seen(lines, [""])
    assert forgetting(known, lines) == known
    known = forgetting(known, statuses(snapshot(), THREE, [other, FINDING | {"gone": True}]))
    pan, elbow, arm = acknowledged(lines, known)
    assert (pan.level, elbow.level, arm.level) == (Level.OK, Level.WARN, Level.WARN)
    assert elbow.name in arm.message


def test_the_arm_is_acknowledged_with_all_that_is_the_matter():
    both = [FINDING, FINDING | {"joint": 0}]
    lines = statuses(snapshot(), THREE, both)
    alone = acknowledged(lines, seen(lines, ["urdyn: arm"]))
    assert [s.level for s in alone] == [Level.WARN, Level.WARN, Level.OK]
    # One of the two is over: the arm's line names the other, which is known.
    left = acknowledged(statuses(snapshot(), THREE, both[:1]), seen(lines, [""]))
    assert {s.level for s in left} == {Level.OK}


def test_the_arm_s_line_names_the_most_urgent_of_what_is_equally_grave():
    push = COLLISION | {"joint": 0}  # which is over
    lines = statuses(snapshot(), THREE, [push, FINDING])
    assert lines[0].level == lines[1].level == Level.WARN
    for told in (lines, acknowledged(lines, {}), acknowledged(lines, seen(lines, [lines[0].name]))):
        assert told[-1].message == "urdyn: elbow_joint: friction increase, 10 min left"
    left = acknowledged(lines, seen(lines, [lines[1].name]))
    assert left[-1].message == "urdyn: shoulder_pan_joint: collision, 10 min left"


def test_a_drive_that_was_acknowledged_is_quiet_until_it_gets_worse():
    line = Status(Level.WARN, "urdyn: wrist_1_joint", "drive health 0.86")
    known = seen((line,), [line.name])
    assert acknowledged((replace(line, message="drive health 0.85"),), known)[0].level == Level.OK
    for worse in (
        replace(line, level=Level.ERROR, message="drive health 0.40"),
        replace(line, message="friction 1.6 times that when commissioned"),
    ):
        assert acknowledged((worse,), known) == (worse,)


class Message:
    """Any message: what it was made of."""

    def __init__(self, **fields):
        self.__dict__.update(fields)


def unheard(now, lines):
    raise OSError("gone")


def unreadable():
    raise OSError("gone")


class Late:
    """An observer who finds something once all is over, and takes his time for it."""

    findings, doubt, told = (), "", None

    def finish(self):
        self.told = len(self.scraped)
        time.sleep(0.4)
        self.findings = (FINDING,)
        return {}

    def __init__(self, scraped):
        self.scraped = scraped
        self.kept = lambda wait: True
        self.begin = self.take = self.miss = self.note = self.keep = self.forget = self.close = (
            lambda *of: None
        )


def silent_before(source, sample, seconds):
    """The source, which says nothing for a while before `sample`."""

    def start(first):
        for index, arrival in enumerate(source.start(first), first):
            if index == sample:
                time.sleep(seconds)
            yield arrival

    return replace(source, start=start)


def test_a_run_that_is_behind_its_robot_says_so_until_it_ends(workshop, tmp_path, monkeypatch):
    monkeypatch.setattr(announce, "PULSE", 0.05)
    scraped = []
    plant = SimpleNamespace(tell=lambda now, lines: scraped.append((now.delay, lines[-1])))
    announcer = Announcer(workshop.fit, Audience(plants=[plant]), "20235")
    late = (Arrival(sample, now() - 5.0) for sample in samples(workshop.log.slice(0, 60)))
    robot = replace(workshop.source, live=True, start=lambda _: late)
    try:
        workshop.track(tmp_path, silent_before(robot, 50, 0.3), watch=announcer.watch)
    finally:
        announcer.close()
    delay, arm = scraped[0]
    assert 5.0 <= delay < 6.0 and arm.level == Level.WARN
    assert arm.message == f"behind by {delay:.1f} s; as commissioned"
    assert scraped[-1][1].message == "as commissioned"


def test_a_run_tells_what_it_writes(workshop, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(announce, "PULSE", 0.05)
    monkeypatch.setattr(announce, "STALE", 0.3)
    monkeypatch.setattr(history_row, "RATE", 1e3)  # [Hz] all of them
    sent, scraped, glances = [], [], []
    voice = Voice(Types(lambda name: Message, int), lambda *one: sent.append(one), True, True)
    plants = [
        SimpleNamespace(tell=unheard),
        SimpleNamespace(tell=lambda now, lines: scraped.append((now, lines))),
    ]
    behind = Status(Level.WARN, "urdyn: node", "falls behind", (), "20235")
    audience = Audience(voice, plants, unreadable, lambda: iter((behind,)))
    announcer = Announcer(workshop.fit, audience, "20235")

    def watch(progress):
        glances.append(progress)
        announcer.watch(progress)

    try:
        part = silent_before(open_source(str(workshop.recording), rows=(0, 500)), 250, 0.5)
        late = Late(scraped)
        summary = workshop.track(tmp_path, part, watch=watch, observer=late)
    finally:
        announcer.close()
    levels = [lines[-2].level for _, lines in scraped]
    assert Level.STALE in levels[: late.told]  # but not once all was told, one that was on its way
    assert Level.STALE not in levels[late.told + 1 :] and levels[-1] == Level.WARN
    assert len(scraped) > 1  # one that cannot be told ends nothing, and is said once
    assert [r.getMessage() for r in caplog.records if "gone" in r.getMessage()] == [
        f"{who}: OSError('gone'); tried again every second" for who in (announce.__name__, __name__)
    ]
    by_topic = {topic: [m for t, m in sent if t == topic] for topic in {t for t, _ in sent}}
    assert len(by_topic["/urdyn/estimates"]) == len(glances) > 450
    last = by_topic["/urdyn/estimates"][-1]
    elbow = last.interface_values[last.joint_names.index("elbow_joint")]
    told = dict(zip(elbow.interface_names, elbow.values, strict=True))
    final = summary["final"]["elbow_joint.coulomb"]
    assert told["coulomb"] == final["mean"] and told["coulomb.sd"] == final["sd"]
    predicted = np.array([m.effort for m in by_topic["/urdyn/predicted_torque"]])
    residual = np.array([m.effort for m in by_topic["/urdyn/residual_torque"]])
    measured = np.array([g.reading.current for g in glances]) * workshop.fit.dynamics.drive.gain
    sure = np.isfinite(predicted)
    healthy = np.array(
        [[by_part(g, JOINT_NAMES)[0][j]["health"] for j in JOINT_NAMES] for g in glances]
    )
    assert sure.mean() > 0.5
    np.testing.assert_allclose((predicted + residual)[sure], (measured * healthy)[sure])
    assert by_topic["/urdyn/payload"][-1].inertia.m == summary["final"]["payload.mass"]["mean"]
    scales = np.array(by_topic["/urdyn/friction_scales"][-1].data)
    drive = workshop.fit.dynamics.drive
    expected = [
        [summary["final"][f"{j}.{name}"]["mean"] for j in JOINT_NAMES] / getattr(drive, name)
        for name in ("viscous", "coulomb")
    ]
    np.testing.assert_allclose(scales, np.ravel(expected))
    forward = np.array([m.data for m in by_topic["/urdyn/feed_forward"]])
    came, healthy = [g for g in glances if not g.ended], healthy[:-2]
    modelled = np.array([g.reading.modelled for g in came]) * workshop.fit.dynamics.drive.gain
    assert forward.shape == modelled.shape  # of every sample, of an arm at rest too
    np.testing.assert_allclose(forward[1:], modelled[1:] * healthy[:-1])
    diagnoses = by_topic["/diagnostics"]
    assert [s.name for s in diagnoses[0].status][-2:] == ["urdyn: arm", "urdyn: node"]
    assert {s.hardware_id for s in diagnoses[0].status} == {"20235"}
    assert "friction increase" in diagnoses[-1].status[-2].message
