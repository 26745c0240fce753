"""What bends a current for a while, or in one joint, bends no other judgement."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from realarm import with_current
from scipy.signal import lfilter
from shop import Shop

from urdyn.diagnose import Finding, Report, diagnose
from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.fast.fast import Fast
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.rows import ROTOR, Rows
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.slow import Slow
from urdyn.diagnose.state import Now
from urdyn.model.population import population
from urdyn.signal import Instant, condition
from urdyn.types import Gaussian, Log

RATE, SLOW = 100.0, 25.0  # [Hz]
NAMES = ("q", "v", "a", "jerk", "current", "temperature", "shift", "instrumental")


def _kinds(report: Report) -> list[tuple[str, int | None]]:
    return sorted((f.kind, f.joint) for f in report)


def test_a_joint_that_rings_has_no_noisy_sensor_and_is_told_once(shop: Shop) -> None:
    """Though its line wanders by more than a loop's does, and neighbours differ by amperes."""
    log = shop.log(seconds=16.0, rate=RATE)
    since = log.t - log.t[0] - 8.0
    pitch = np.where(since < 2.0, 20.0, 23.0)  # [Hz]
    swing = 9.0 * np.sin(2.0 * np.pi * np.cumsum(pitch) / RATE)
    report = shop.disturbed(log, 2, np.where(since > 0.0, swing, 0.0))
    assert _kinds(report) == [("controller_instability", 2)]


def test_a_loop_that_rings_in_bursts_is_no_noisy_sensor_and_rings_since_the_first(
    shop: Shop,
) -> None:
    """The first is too short for a swing, and loud; the beat that tells of it is bent already."""
    where, rng = space(shop.fit), np.random.default_rng(3)
    t, start, step = np.arange(0.0, 8.0, 0.008), 4.0, 30
    bursts = ((t > start) & (t < start + 0.85)) | (t > start + 1.35)
    current = where.noise * rng.standard_normal((len(t), 6))
    current[:, 0] += 2.0 * bursts * np.sin(2.0 * np.pi * 26.6 * t)
    seen = _unasked(t, current)
    fast = Fast(where, 0.008, read_rules().fast, 1e-3)
    state, events = fast.init(), list[Event]()
    while not events:
        state, events, untrue = fast.step(state, seen.part(0, step), np.zeros((1, 10)))
        seen = seen.part(step, len(seen))
    assert {(event.kind, event.joint) for event in events} == {("controller_instability", 0)}
    assert abs(events[0].onset - start) < events[0].within
    assert untrue[:, 0].all() and not untrue[:, 1:].any()


def _unasked(t: np.ndarray, current: np.ndarray) -> Rows:
    """Currents (N, 6) [A] of an arm that would take none."""
    shapes = {"tool": (len(t), 6, 10), "drive": (len(t), ROTOR + 1, 6)}
    given = {f.name: np.zeros(shapes.get(f.name, (len(t), 6))) for f in fields(Rows)}
    return Rows(**given | {"t": t, "current": current})


@pytest.mark.parametrize("learnt", [True, False])
def test_friction_that_commissioning_left_unknown_is_no_push(shop: Shop, learnt: bool) -> None:
    where, t = space(shop.fit), np.arange(0.0, 3.0, 0.008)
    where = replace(where, unlearnt=~np.full(6, learnt) & (np.arange(6) < 3))
    current = where.noise * np.random.default_rng(4).standard_normal((len(t), 6))
    current[(t > 1.5) & (t < 1.8), :3] += 20.0 * where.noise[:3]
    fast = Fast(where, 0.008, read_rules().fast, 1e-3)
    _, events, untrue = fast.step(fast.init(), _unasked(t, current), np.zeros((1, 10)))
    assert (untrue == where.unlearnt).all()  # nor does it tell the slow kinds anything
    assert {event.kind for event in events} == ({"collision"} if learnt else set())


def test_a_joint_that_commissioning_left_unknown_is_not_judged(shop: Shop) -> None:
    at = [shop.fit.names.index(f"{joint}.coulomb") for joint in shop.fit.dynamics.arm.joint_names]
    cov, prior = shop.fit.belief.cov.copy(), population(shop.fit.dynamics.arm).drive["coulomb"].sd
    cov[at[4], at[4]] = prior[4] ** 2
    fit = replace(shop.fit, belief=Gaussian(shop.fit.belief.mean, cov))
    diagnosis = Diagnosis(fit, 0.008)
    state = diagnosis.init()
    reversals = replace(state.fast.reversals, slid=np.full(6, 60.0))
    state = replace(state, fast=replace(state.fast, reversals=reversals))
    state = replace(state, book=replace(state.book, upto=60.0))
    assert diagnosis.judged(state) == [True, True, True, True, False, True]


def test_the_drive_that_does_most_rings_whichever_line_is_the_clearest(shop: Shop) -> None:
    """A neighbour that it shakes may keep the phase, and its own loop, which hunts, does not."""
    log = shop.log(seconds=16.0)
    since = log.t - log.t[0] - 8.0
    turn, hunts = 2.0 * np.pi * 13.0 * since, 1.6 * np.sin(2.0 * np.pi * 0.5 * since)
    size = shop.dynamics.drive.coulomb / shop.dynamics.drive.gain * (since > 0.0)[:, None]
    current = log.joint("actual_current").copy()
    current[:, 1] += 0.3 * size[:, 1] * np.sin(turn)
    current[:, 3] += 1.2 * size[:, 3] * np.sin(turn + hunts)
    report = diagnose(shop.fit, with_current(log, current))
    assert _kinds(report) == [("controller_instability", 3)]


def test_a_sensor_that_drops_now_and_then_hides_no_other_joints_fault(shop: Shop) -> None:
    """Every burst is told as another beginning; what is not there bends nothing that is."""
    log = shop.log(
        "friction_increase:joint=3,onset=25,rate=0.6,shape=step", seconds=55.0, rate=SLOW
    )
    since, current = log.t - log.t[0], log.joint("actual_current").copy()
    current[(since > 10.0) & (since % 3.0 < 0.4), 4] = np.nan
    report = diagnose(shop.fit, with_current(log, current))
    assert _kinds(report) == [("friction_increase", 3), ("sensor_fault", 4)]


def _torn(log: Log, what: str) -> Log:
    """A joint's current that is now and then none, from the tenth second on."""
    rng, current = np.random.default_rng(6), log.joint("actual_current").copy()
    since = log.t - log.t[0]
    match what:
        case "zeros":
            current[(since > 10.0) & (rng.random(len(since)) < 0.05), 1] = 0.0
        case "lapses":
            current[(since > 10.0) & (rng.random(len(since)) < 0.05), 1] = np.nan
        case "bursts":
            current[(since > 10.0) & (since % 2.0 < 0.15), 1] = 0.0
        case "spikes":
            there = (since > 10.0) & (rng.random(len(since)) < 0.03)
            current[there, 1] += rng.choice([-3.0, 3.0], np.count_nonzero(there))
    return with_current(log, current)


@pytest.mark.parametrize(
    "what",
    ["spikes", *(pytest.param(w, marks=pytest.mark.slow) for w in ("lapses", "zeros", "bursts"))],
)
def test_values_that_are_none_are_a_sensors_and_no_push_or_wear(shop: Shop, what: str) -> None:
    log = shop.log(seconds=30.0, rate=RATE)
    torn = _torn(log, what)
    (finding,) = diagnose(shop.fit, torn).findings
    assert (finding.kind, finding.joint) == ("sensor_fault", 1)
    was, now = (of.joint("actual_current")[:, 1] for of in (log, torn))
    assert finding.onset_s == pytest.approx(log.t[np.argmax(was != now)], abs=0.02)


def test_a_sensor_that_is_stuck_while_its_joint_rests_is_so_since_then(shop: Shop) -> None:
    """Nothing shows before the joint moves on, and yet the value has been the same."""
    log = shop.log(seconds=20.0, motion="point_to_point")
    rests = np.abs(log.joint("actual_qd")[:, 3]) < 1e-3
    rests &= np.concatenate([rests[30:], np.zeros(30, dtype=bool)])  # for .3 s on
    begin = int(np.flatnonzero(rests & (log.t - log.t[0] > 5.0))[0]) + 5
    current = log.joint("actual_current").copy()
    current[begin:, 3] = current[begin, 3]
    (finding,) = diagnose(shop.fit, with_current(log, current)).findings
    assert (finding.kind, finding.joint) == ("sensor_fault", 3)
    assert finding.onset_s == pytest.approx(log.t[begin], abs=0.02)
    assert finding.alarm_s > log.t[begin] + 0.3


def test_beside_values_that_are_none_the_same_joints_fault_is_told(shop: Shop) -> None:
    log = shop.log(
        "friction_increase:joint=1,onset=25,rate=0.6,shape=step", seconds=55.0, rate=SLOW
    )
    report = diagnose(shop.fit, _torn(log, "zeros"))
    assert _kinds(report) == [("friction_increase", 1), ("sensor_fault", 1)]


@pytest.mark.parametrize(
    "joint", [1, *(pytest.param(j, marks=pytest.mark.slow) for j in (0, 2, 3, 4, 5))]
)
def test_a_sensor_that_tells_less_than_there_is_is_no_neighbours_fault(
    shop: Shop, joint: int
) -> None:
    """No drive of which all is true needs less than all of its current."""
    log, gain = shop.log(seconds=40.0, rate=SLOW), 0.75
    current = log.joint("actual_current").copy()
    current[log.t - log.t[0] > 15.0, joint] *= gain
    (finding,) = diagnose(shop.fit, with_current(log, current)).findings
    assert (finding.kind, finding.joint) == ("sensor_fault", joint)
    assert finding.quantity == "gain of the current sensor"
    assert abs(finding.size - (gain - 1.0)) < 0.06
    assert finding.onset_interval_s[0] <= log.t[0] + 15.0 <= finding.onset_interval_s[1]


def test_a_sensor_that_tells_more_than_there_is_looks_like_a_drive_that_lost_health(
    shop: Shop,
) -> None:
    """Nothing that is measured tells them apart, and the finding says so."""
    log = shop.log(seconds=40.0, rate=SLOW)
    current = log.joint("actual_current").copy()
    current[log.t - log.t[0] > 15.0, 1] *= 1.25
    (finding,) = diagnose(shop.fit, with_current(log, current)).findings
    assert (finding.kind, finding.joint) == ("health_degradation", 1)
    assert abs(finding.size - (1.0 / 1.25 - 1.0)) < 0.06
    assert "a current sensor that reads too high, or more friction" in finding.text


def test_an_arm_without_power_has_no_sensor_that_fails(shop: Shop) -> None:
    """All currents are nothing then."""
    log = shop.log(seconds=20.0, rate=RATE)
    current = log.joint("actual_current").copy()
    current[np.random.default_rng(6).random(len(current)) < 0.02] = 0.0
    assert not diagnose(shop.fit, with_current(log, current)).findings


@pytest.mark.parametrize(
    ("lasts", "times", "soonest"),
    [(2.0, 3.7, None), (5.0, 5.0, 1.0), pytest.param(5.0, 10.0, 1.0, marks=pytest.mark.slow)],
)
def test_a_sensor_is_noisy_for_longer_than_a_joint_rattles_at_its_fastest(
    shop: Shop, lasts: float, times: float, soonest: float | None
) -> None:
    """A real elbow did so for a second and a quarter, with three to four times the usual noise."""
    log, begin = shop.log(seconds=16.0, rate=RATE), 8.0
    since, noise = log.t - log.t[0] - begin, shop.fit.noise.sd[2] * shop.dynamics.drive.gain[2]
    rattle = times * noise * np.random.default_rng(3).standard_normal(len(since))
    report = shop.disturbed(log, 2, np.where((since > 0.0) & (since < lasts), rattle, 0.0))
    if soonest is None:
        assert not report.findings
    else:
        (finding,) = report.findings
        assert (finding.kind, finding.joint) == ("sensor_fault", 2)
        assert abs(finding.onset_s - log.t[0] - begin) < 0.5
        assert soonest < finding.alarm_s - log.t[0] - begin < 3.0


def _moved(log: Log, joint: int, way: np.ndarray, speed: np.ndarray) -> Log:
    """The same run with a joint's angle and velocity moved by these, (N,)."""
    q, v = log.joint("actual_q").copy(), log.joint("actual_qd").copy()
    q[:, joint] += way
    v[:, joint] += speed
    return replace(log, channels={**log.channels, "actual_q": q, "actual_qd": v})


MIDDLE = 13.0  # [s]


def _slipped(shop: Shop, slip: float, within: float = 1e-3) -> Log:
    """Of 26 s at 125 Hz, an encoder reads `slip` [rad] more from the middle on, `within` so long.

    Its velocity follows, by an observer of 3 ms. Its loop moves the joint until the angle is where
    it should be: the arm goes on beside it.
    """
    log = shop.log(seconds=2.0 * MIDDLE, rate=125.0)
    since, period = log.t - log.t[0] - MIDDLE, float(np.median(np.diff(log.t)))
    gone, pole = np.maximum(since, 0.0), 1.0 / 0.04
    taken = slip * (1.0 - (1.0 + pole * gone) * np.exp(-pole * gone))
    arm = _moved(log, 1, -taken, -slip * pole**2 * gone * np.exp(-pole * gone))
    answer = shop.dynamics.current(condition(arm)) - shop.dynamics.current(condition(log))
    read = slip * np.clip(since / within + 1.0, 0.0, 1.0) - taken
    keep = np.exp(-period / 0.003)
    speed = lfilter([1.0 - keep], [1.0, -keep], np.diff(read, prepend=0.0) / period)
    return with_current(_moved(log, 1, read, speed), log.joint("actual_current") + answer)


@pytest.mark.parametrize("slip", [pytest.param(-0.012, marks=pytest.mark.slow), 0.025])
def test_an_encoder_that_jumps_and_its_velocity_with_it_is_one_fault(
    shop: Shop, slip: float
) -> None:
    log = _slipped(shop, slip)
    (finding,) = diagnose(shop.fit, log).findings
    assert (finding.kind, finding.joint) == ("encoder_offset", 1)
    assert abs(finding.size + slip) < 0.05 * abs(slip)
    assert abs(finding.onset_s - log.t[0] - MIDDLE) < 0.008


def test_one_that_slips_within_some_samples_is_no_other_fault(shop: Shop) -> None:
    """It asks for amperes within them, which no state of the arm explains."""
    report = diagnose(shop.fit, _slipped(shop, -0.04, within=0.03))
    assert set(_kinds(report)) <= {("encoder_offset", 1)}


@pytest.mark.parametrize("later", [2.0, pytest.param(300.0, marks=pytest.mark.slow)])
def test_a_clock_that_jumps_within_a_beat_is_a_pause(shop: Shop, later: float) -> None:
    log = shop.log(seconds=9.0, rate=RATE)
    t = np.where(np.arange(len(log.t)) < 707, log.t, log.t + later)
    assert not diagnose(shop.fit, replace(log, t=t)).findings
    assert not _live(shop, replace(log, t=t))


def test_half_a_second_of_which_nobody_knows_anything_is_one_too(shop: Shop) -> None:
    log = shop.log(seconds=14.0, rate=RATE)
    channels = {name: np.array(of, dtype=float) for name, of in log.channels.items()}
    for of in channels.values():
        of[710:760] = np.nan
    assert not diagnose(shop.fit, replace(log, channels=channels)).findings


def _live(shop: Shop, log: Log) -> list[Finding]:
    """What is told instant by instant."""
    motion, s, moved = shop.motion(log)
    diagnosis, found = shop.diagnosis(log), list[Finding]()
    state = diagnosis.init()
    for k in range(len(motion)):
        of = (getattr(motion, name)[k] for name in NAMES)
        instant = Instant(float(motion.t[k]), *of)
        state, more = diagnosis.step(state, Now(instant, s[k], moved[k]))
        found += more
    return found


def test_a_fault_that_this_block_tells_of_is_no_light_piece(
    shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The block that would be forgotten for a piece is asked first what it says by itself."""
    log = shop.log(seconds=4.0)
    slow = shop.diagnosis(log).slow
    state = slow.init()
    state = replace(state, gathering=replace(state.gathering, moments=3))
    asked = []

    def ended(self: Slow, of: object) -> object:
        return replace(state, known=(Fault(0, 0.0, 0.0, 1.0, 1.0),))

    monkeypatch.setattr(Slow, "_block", ended)
    monkeypatch.setattr(type(state.carrying), "due", property(lambda self: True))
    monkeypatch.setattr(type(slow.loads), "noticed", lambda *of: asked.append(of))
    assert slow._noticed(state) is None and not asked
