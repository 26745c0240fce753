"""A gap shows where a load turns over quickly, and it is said where it does not."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from shop import Shop

from urdyn.diagnose import Report, diagnose
from urdyn.diagnose.fast.backlash import HALF, Backlash, _forgotten, _unseen, _weighed
from urdyn.diagnose.fast.crossing import Crossing
from urdyn.diagnose.fast.flight import KNOWN, Beside, Flight, _strikes
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.space import space
from urdyn.identify.noise import Noise
from urdyn.simulate import (
    Trajectory,
    Work,
    forward,
    happening,
    observe,
    parse_fault,
    plan,
    to_and_fro,
    typical_gears,
    typical_sensors,
)
from urdyn.types import Log

RATE = 500.0


def _swung(
    shop: Shop, joint: int, *faults: str, rate: float = RATE, seconds: float = 5.0
) -> Report:
    """What is told of a joint that goes to and fro."""
    arm = shop.dynamics.arm
    work = Work(to_and_fro(arm, joint, seconds, rate))
    events = happening(
        shop.dynamics, work, tuple(parse_fault(f, arm.joints) for f in faults), False
    )
    rng = np.random.default_rng(joint)
    return diagnose(
        shop.fit, observe(shop.dynamics, work.trajectory, typical_sensors(arm), rng, events)
    )


def _seen(report: Report, joint: int) -> dict:
    return report.document["observability"]["joint_backlash"][joint]


def test_a_gap_of_a_tenth_of_a_milliradian_is_found_within_six_reversals(shop: Shop) -> None:
    report = _swung(shop, 1, "joint_backlash:joint=1,onset=0,rate=1e-4,shape=step")
    (finding,) = report.findings
    assert (finding.kind, finding.joint) == ("joint_backlash", 1)
    assert finding.evidence["reversals"] <= 6
    assert 0.5e-4 < finding.size < 2e-4
    row = _seen(report, 1)
    assert row["observable"] and row["half_gap_rad"] <= 1e-4


def test_a_sound_gear_has_no_gap_however_it_turns(shop: Shop) -> None:
    report = _swung(shop, 1)
    assert not report.findings and _seen(report, 1)["observable"]


@pytest.mark.parametrize("keeps", [0.0, 0.9])
def test_noise_of_any_colour_is_a_gap_no_more_often_than_that_is_likely(
    shop: Shop, keeps: float
) -> None:
    """A sensor that filters makes noise that lasts as long as a gap takes; the model knows it."""
    j, rng, of = 2, np.random.default_rng(31), space(shop.fit)
    scale = of.noise * np.sqrt(1.0 - keeps**2)
    colour = Noise(of.noise, scale, dof=np.full(6, 1e18), ar=np.full((6, 1), keeps))
    of = replace(of, colour=colour)
    after = (np.arange(100) - 19.5) / RATE
    load, light, T = 60.0 * after, 20.0 * after, 0.06
    rows = SimpleNamespace(v=np.ones((100, 6)), doubt=np.zeros((100, 6)))
    crossing, flight = Crossing(of, 1.0 / RATE), Flight(of, 1.0 / RATE)
    known = np.stack([light, np.gradient(light, after), np.zeros(100)], axis=1) * KNOWN
    gone, K = light * ((after > 0.0) & (after < T)), of.reference.drive.gain[j]
    lacking = 10.0 * T**2 * _strikes(after - T) - gone
    told = []
    for _ in range(1000):
        drawn = scale[j] * rng.standard_normal(300)
        left = lfilter([1.0], [1.0, -keeps], drawn)[200:]
        beside = Beside(
            flight.averaged(left), rows.doubt[:, j], known / K, rows.v[:, j], left == left, K, j
        )
        crossed = crossing.weigh(rows, after, load=load, left=left, j=j)[0]
        told.append([*crossed[:4], flight._weigh(beside, after, lacking, T)[0]])
    ratios = np.exp(told)
    assert (ratios.mean(axis=0) < 1.0 + 4.0 * ratios.std(axis=0) / np.sqrt(len(told))).all()
    assert (np.ptp(ratios, axis=0)[3:] > 0.5).all()


def _pushed(shop: Shop, joint: int, q: list[float], a: np.ndarray) -> Report:
    """What is told of a sound arm, one joint of which accelerates so [rad/s²], from rest at q."""
    n, arm = round(RATE), shop.dynamics.arm
    motion = np.zeros((3, len(a), arm.joints))
    motion[2, :, joint] = a
    motion[1] = np.cumsum(motion[2], axis=0) / n
    motion[0] = np.array(q) + np.cumsum(motion[1], axis=0) / n
    work = Work(Trajectory(np.arange(len(a)) / n, *motion))
    lived = happening(shop.dynamics, work, (), False)
    rng, sensors = np.random.default_rng(9), typical_sensors(arm)
    return diagnose(shop.fit, observe(shop.dynamics, work.trajectory, sensors, rng, lived))


def test_a_load_that_jumps_over_is_no_gap(shop: Shop) -> None:
    """Accelerations are told from some hundredths of a second, and jump in none of them."""
    there = np.repeat([1.0, 0.04, -1.0], [150, 100, 154])  # from rest to rest
    a = 4.0 * np.tile(np.concatenate([there, -there]), 8)
    assert not _pushed(shop, 0, [0.0, -1.3, 1.2, -1.4, -1.5, 0.0], a)


def test_a_load_that_jumps_soon_after_it_turned_over_is_no_gap(shop: Shop) -> None:
    """Gravity turns over while the joint keeps its speed, and soon it brakes: no link struck."""
    there = np.repeat([1.0, 0.0, -1.0], 79)
    a = 8.0 * np.tile(np.concatenate([there, -there]), 5)
    assert not _pushed(shop, 1, [0.3, -2.05, 1.1, -0.9, 0.8, 0.2], a)


def test_a_load_that_turns_over_slowly_is_said_to_show_no_gap(shop: Shop) -> None:
    """A hand that weighs next to nothing leaves its motor alone, gap or no gap."""
    report = _swung(shop, 5, "joint_backlash:joint=5,onset=0,rate=1e-3,shape=step")
    row = _seen(report, 5)
    assert not report.findings
    assert not row["observable"] and "not observable" in row["why"] and "wrist_3" in row["probe"]
    assert "no motion" in row["probe"]


@pytest.mark.parametrize(
    ("gap", "seconds"), [pytest.param(1e-3, 45.0, marks=pytest.mark.slow), (1.6e-3, 30.0)]
)
def test_a_wide_gap_of_a_slow_rotor_is_found_though_it_takes_long_to_cross(
    shop: Shop, gap: float, seconds: float
) -> None:
    """At 100 Hz a milliradian shows by two thirds of a nat a second, and 16 are needed."""
    fault = f"joint_backlash:joint=0,onset=0,rate={gap},shape=step"
    report = _swung(shop, 0, fault, rate=100.0, seconds=seconds)
    (finding,) = report.findings
    assert (finding.kind, finding.joint) == ("joint_backlash", 0)
    assert 0.5 * gap < finding.size < 2.0 * gap


def _looped(shop: Shop, joint: int, half_gap: float, trajectory: Trajectory) -> Report:
    """What is told of an arm in its controller's hands, whose link flies where its load is gone."""
    arm = shop.dynamics.arm
    fault = f"joint_backlash:joint={joint},onset=0,rate={half_gap},shape=step"
    elastic = partial(forward, gears=typical_gears(arm))
    rng = np.random.default_rng(joint)
    events = (parse_fault(fault, arm.joints),)
    log = observe(shop.dynamics, trajectory, typical_sensors(arm), rng, events, elastic)
    return diagnose(shop.fit, log)


@pytest.mark.parametrize("gap", [2e-3, pytest.param(4e-3, marks=pytest.mark.slow)])
def test_a_gap_through_which_the_link_flies_is_found_and_measured(shop: Shop, gap) -> None:
    """For .08 s or so, of which accelerations tell 20 ms: to the third power a factor of two."""
    swing = to_and_fro(shop.dynamics.arm, 2, 5.0, RATE)
    (finding,) = _looped(shop, 2, gap, swing).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", 2)
    assert 0.5 * gap < finding.size < 2.0 * gap


@pytest.mark.parametrize("gap", [1e-3, pytest.param(2e-3, marks=pytest.mark.slow)])
def test_a_flight_is_found_though_the_load_turns_over_at_another_moment(
    shop: Shop, gap: float
) -> None:
    """What a load is wrong by turns it over early or late; a strike may be brief."""
    arm, j, late = shop.dynamics.arm, 2, 0.03
    work = Work(to_and_fro(arm, j, 5.0, RATE))
    rng = np.random.default_rng(j)
    lived = happening(shop.dynamics, work, (), False)
    log = observe(shop.dynamics, work.trajectory, typical_sensors(arm), rng, lived)
    motion = work.trajectory.at(log.t + late)
    load = arm.torque(motion.q, motion.v, motion.a)[:, j]
    inertia = arm.torque_derivatives(motion.q, motion.v, motion.a)[2][:, j, j]
    lacking = np.zeros(len(log.t))
    for row in np.flatnonzero(load[1:] * load[:-1] < 0.0) + 1:
        after = log.t - log.t[row]
        slope = RATE * (load[row] - load[row - 1])
        T = np.cbrt(12.0 * gap * inertia[row] / abs(slope))
        blow = np.where(after > T, np.exp(-(after - T).clip(0.0) / 0.02), 0.0) / 0.02
        lacking += 0.5 * slope * T**2 * blow - load * ((after > 0.0) & (after < T))
    (finding,) = shop.disturbed(log, j, lacking).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", j)
    assert 0.5 * gap < finding.size < 2.0 * gap


@pytest.mark.slow
def test_a_link_that_flies_is_found_from_point_to_point(shop: Shop) -> None:
    """There loads jump over, and a motor that crosses a gap shows nothing."""
    work = plan("point_to_point", shop.dynamics.arm, 15.0, 125.0, np.random.default_rng(3))
    (finding,) = _looped(shop, 0, 3e-3, work.trajectory).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", 0)
    assert 1.5e-3 < finding.size < 6e-3


def test_a_gear_that_gives_has_no_gap(shop: Shop) -> None:
    swing = to_and_fro(shop.dynamics.arm, 2, 5.0, RATE)
    assert not _looped(shop, 2, 0.0, swing).findings


@pytest.mark.slow
def test_a_wide_gap_is_no_other_fault(shop: Shop) -> None:
    fault = "joint_backlash:joint=2,onset=12,rate=1e-3,shape=step"
    report = _swung(shop, 2, fault, rate=100.0, seconds=60.0)
    assert [(f.kind, f.joint) for f in report.findings] == [("joint_backlash", 2)]


def test_what_a_neighbours_gap_jolts_is_no_gap_of_its_own(shop: Shop) -> None:
    """At the same instants only the likelier joint's gap is seen; at others both are."""
    tester = Backlash(space(shop.fit), 0.002, read_rules().fast.joint_backlash)
    alone, both = np.eye(6, dtype=bool)[2], np.isin(np.arange(6), [1, 2])
    llr = np.linspace(-3.0, 12.0, len(HALF))

    def known(nats: dict[int, float]):
        R = np.full((6, len(HALF)), -np.inf)
        R[list(nats), 0] = list(nats.values())
        return replace(tester.init(), R=R)

    likely = known({1: 40.0, 2: 10.0})
    assert np.allclose(tester._own(likely, 2, llr, alone), llr)
    assert np.abs(tester._own(likely, 2, llr, both)).max() < 1e-3
    assert np.allclose(tester._own(likely, 1, llr, both), llr, atol=1e-3)
    # Where neither is likely yet, either may be: some chance has made neighbours likelier.
    assert np.allclose(tester._own(known({1: 3.0}), 2, llr, both), llr, atol=0.01)


@pytest.mark.parametrize(
    ("said", "since"),
    [([-5.0, 0.0, 0.0, 8.0, 8.0], 0), ([-5.0, -0.8, -0.8, 8.0, 8.0], 0), ([-5.0, -5.0, 8.0], 1),
     ([-5.0, 0.0, -5.0, 8.0, -0.8, 8.0], 2)],
)  # fmt: skip
def test_a_gap_may_have_opened_since_the_last_reversal_that_said_there_was_none(
    shop: Shop, said: list[float], since: int
) -> None:
    state = Backlash(space(shop.fit), 0.002, read_rules().fast.joint_backlash).init()
    for k, each in enumerate(said):
        llr = np.full(len(HALF), each)
        state = _weighed(state, 1, llr, np.ones_like(llr), float(k))
    assert _unseen(state, 1) == since


def test_a_load_that_turns_over_while_its_joint_swings_tells_of_no_gap(shop: Shop) -> None:
    """Nor does what was told since the swing began, before it was heard."""
    fault = "joint_backlash:joint=1,onset=0,rate=1e-4,shape=step"
    arm, joint = shop.dynamics.arm, np.arange(6) == 1
    work = Work(to_and_fro(arm, 1, 5.0, RATE))
    events = happening(shop.dynamics, work, (parse_fault(fault, arm.joints),), False)
    rng, sensors = np.random.default_rng(1), typical_sensors(arm)
    log = observe(shop.dynamics, work.trajectory, sensors, rng, events)
    diagnosis, (motion, s, travelled) = shop.diagnosis(log), shop.motion(log)
    tester = diagnosis.fast.backlash

    def told(swung: np.ndarray):
        state, reversals, found = diagnosis.init(), tester.init(), []
        for at in range(0, len(motion.t) - 125, 125):
            part = np.arange(at, at + 125)
            state, rows = diagnosis._rows(state, motion.rows(part, ()), s[part], travelled[part])
            how = np.zeros(10), np.zeros(6, dtype=bool), swung, np.zeros((0, 2))
            reversals, events, _ = tester.step(reversals, rows, *how)
            found += events
        return reversals, [event.joint for event in found]

    never, always = np.full((2, 6), np.inf), np.where(joint, [[0.0], [np.inf]], np.inf)
    before, found = told(never)
    assert found == [1] and np.nanmin(before.since[1]) > 0.0
    rung, found = told(always)
    assert (
        found == []
        and not rung.count[1]
        and np.array_equal(rung.count[~joint], before.count[~joint])
    )
    after = _forgotten(before, always)
    assert np.isneginf(after.R[1][np.isfinite(before.since[1])]).all()
    assert np.array_equal(after.R[~joint], before.R[~joint])


@pytest.mark.parametrize("rate", [1.0, 5.0])
def test_a_log_of_few_samples_a_second_is_looked_at_all_the_same(shop: Shop, rate: float) -> None:
    """No reversal has samples enough around it, or none at all."""
    assert not _swung(shop, 1, rate=rate, seconds=60.0).findings


def test_nor_does_a_reversal_within_a_pause_of_the_recording_break_it(shop: Shop) -> None:
    log = shop.log(seconds=12.0)
    kept = (log.t < log.t[0] + 4.0) | (log.t > log.t[0] + 7.0)
    channels = {name: values[kept] for name, values in log.channels.items()}
    assert not diagnose(shop.fit, Log(log.t[kept], channels)).findings


def test_what_the_tool_carries_hangs_on_a_gear_that_may_have_play(shop: Shop) -> None:
    """Its weight turns loads over at other times, and its inertia flies with the link."""
    of, arm = space(shop.fit), shop.dynamics.arm
    tool = np.array([3.0, 0.0, 0.0, 0.3, 0.04, 0.04, 0.01, 0.0, 0.0, 0.0])
    rng, shape = np.random.default_rng(7), (4, arm.joints)
    per_unit = rng.standard_normal((*shape, 10))
    rows = SimpleNamespace(
        tool=per_unit, load=rng.standard_normal(shape), residual=rng.standard_normal(shape)
    )
    seen = Backlash(of, 1.0 / RATE, read_rules().fast.joint_backlash)._loaded(rows, tool)
    K = of.reference.drive.gain
    np.testing.assert_allclose(seen.load, rows.load + K * (per_unit @ tool))
    np.testing.assert_allclose(seen.left, rows.residual - per_unit @ tool)

    q, still = np.array([0.3, -1.2, 1.1, -0.7, 0.9, 0.2]), np.zeros(arm.joints)
    carried = of.arm.inertials + np.eye(arm.joints)[-1][:, None] * tool
    for j, start in enumerate(np.eye(arm.joints)):
        pulls = of.arm.torque(q, still, start, carried) - of.arm.torque(q, still, still, carried)
        assert Flight(of, 1.0 / RATE)._mass(q, j, tool) == pytest.approx(pulls[j])


def test_a_jolt_beside_a_known_gap_is_no_gap_of_its_own(shop: Shop) -> None:
    backlash, llr = (
        Backlash(space(shop.fit), 1.0 / RATE, read_rules().fast.joint_backlash),
        np.array([8.0]),
    )
    nothing, beside = backlash.init(), np.arange(6) == 4
    known = replace(nothing, R=np.where(beside[:, None], 60.0, nothing.R))
    assert backlash._own(nothing, 1, llr, beside) == pytest.approx(llr)
    assert backlash._own(known, 1, llr, ~(beside | True)) == pytest.approx(llr)
    assert abs(backlash._own(known, 1, llr, beside)) < 1e-6
