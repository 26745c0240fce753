"""What comes and goes is a push; what is there still is none, and no part of one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from realarm import with_current
from shop import Shop

from urdyn.diagnose import diagnose
from urdyn.diagnose.diagnosis import _told_of
from urdyn.diagnose.fast.collision import Collision
from urdyn.diagnose.fast.pushed_link import BIN, LOUD, MODEL, Bin, Pushed
from urdyn.diagnose.fast.pushed_link import FORCE as BEFORE
from urdyn.diagnose.findings.event_finding import of_event
from urdyn.diagnose.kinds.change import Push
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.load.carried import ANYTHING
from urdyn.diagnose.residual.rows import rows
from urdyn.diagnose.residual.space import Space, space
from urdyn.diagnose.residual.warmth import unfelt
from urdyn.model.arm import read_arm
from urdyn.simulate import (
    Payload,
    Trajectory,
    Work,
    happening,
    observe,
    parse_fault,
    typical_sensors,
)
from urdyn.simulate.rigid import pushed
from urdyn.simulate.schedule import course
from urdyn.simulate.wrench import wrenches
from urdyn.types import NORMAL90

CALM = 3
Q = np.array([0.3, -1.2, 1.0, -0.6, 0.7, 0.2])  # [rad]
FORCE = np.array([60.0, -70.0, 40.0])  # [N] in the axes of the pendant's base
NOTHING = np.zeros((1, 10))
HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # from base_link's axes to those of the pendant's base
PENDULUM = """<robot name="pendulum"><link name="base"/><link name="arm"><inertial>
<origin xyz="0 0 0.3"/><mass value="4"/>
<inertia ixx=".1" iyy=".1" izz=".02" ixy="0" ixz="0" iyz="0"/>
</inertial></link><link name="tool0"/>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="100" velocity="3"/></joint>
<joint name="t" type="fixed"><parent link="arm"/><child link="tool0"/>
<origin xyz="0 0 0.6"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def where(shop: Shop) -> Space:
    return space(shop.fit)


def _bins(where: Space, felt: np.ndarray) -> tuple[Bin, ...]:
    """Bins of an arm that moves by Q, felt (B, J) [N·m] beside noise of 1 N·m."""
    still = np.zeros(6)
    tool = where.arm.regressor(Q, still, still)[..., -10:]
    noise = np.random.default_rng(2).standard_normal(felt.shape)
    return tuple(
        Bin(
            k * BIN,
            False,
            row,
            row,
            np.ones(6),
            np.zeros(6),
            np.zeros((2, 6)),
            Q,
            tool,
            np.zeros(10),
        )
        for k, row in enumerate(felt + 0.2 * noise)
    )


def _pushed(where: Space, link: int) -> np.ndarray:
    """What a push of FORCE on a link makes drives do, (8, J) [N·m]: half a sine, then nothing."""
    course = np.append(np.sin(np.pi * np.linspace(0.1, 0.9, 5)), np.zeros(CALM))
    return np.outer(course, -_lever(where, Q, link, 0.5).T @ FORCE)


def _lever(where: Space, q: np.ndarray, link: int, part: float) -> np.ndarray:
    """How a point of a link moves, `part` of the way to the next joint, per joint speed (3, J).

    In the axes of the pendant's base.
    """
    arm = where.reference.arm
    frame, following = (arm.pose(q, name) for name in (*arm.link_names, arm.tool)[link : link + 2])
    lever = part * (following[:3, 3] - frame[:3, 3])
    twist = arm.jacobian(q, arm.link_names[link])
    moves = np.where(np.arange(6) <= link, twist[:3] + np.cross(twist[3:], lever, axis=0), 0.0)
    return HALF_TURN @ moves


def _event(where: Space, felt: np.ndarray):
    return Pushed(where, 15.0).event(_bins(where, felt), CALM, NOTHING, np.zeros(6, dtype=bool))


def test_a_push_is_told_with_its_link_and_force(where: Space) -> None:
    event = _event(where, _pushed(where, 4))
    assert event.joint == 4
    # The mean over the strong part of half a sine is .87 of its peak.
    assert np.allclose(event.evidence["force_N"], 0.87 * FORCE, atol=0.15 * np.linalg.norm(FORCE))


def test_a_push_is_told_in_the_axes_of_the_controllers_own_force(shop: Shop, where: Space) -> None:
    arm, t, still = where.reference.arm, BIN * np.arange(8), np.zeros((8, 6))
    push = parse_fault("collision:link=5,force=60/-70/40,duration=0.2", 6)
    now, motion = course(shop.dynamics, [push], t), Trajectory(t, Q + still, still, still).at(t)
    own = wrenches(shop.dynamics, now, motion)["actual_TCP_force"][:, :3]
    event = _event(where, -pushed(arm, motion.q, now.push))
    away = event.evidence["force_N"] - own[2:4].mean(axis=0)  # the loud bins
    assert np.linalg.norm(away) < 0.15 * np.linalg.norm(FORCE)
    assert "of the pendant's base" in of_event(event, where, read_rules()).text


def test_a_push_on_an_arm_without_a_controllers_base_is_told_in_its_roots_axes(
    where: Space,
) -> None:
    bare = read_arm(where.reference.arm.urdf.replace('"base"', '"stand"'))
    foreign = replace(where, reference=replace(where.reference, arm=bare))
    event, known = (_event(arm, _pushed(where, 3)) for arm in (foreign, where))
    assert np.allclose(event.evidence["force_N"], HALF_TURN @ known.evidence["force_N"])
    assert "of the root link" in of_event(event, foreign, read_rules()).text


def test_a_push_on_an_arm_of_one_joint_is_on_its_only_link() -> None:
    """Of several links the first is left out, as one joint alone feels it."""
    arm, one = read_arm(PENDULUM), np.ones(1)
    push = np.array([[[100.0, 0.0, 0.0, 0.0, 0.0, 0.0]]])
    felt = -pushed(arm, np.zeros((1, 1)), push)[0]
    assert felt == pytest.approx(-30.0)  # 0.3 m from the joint
    alone: Any = SimpleNamespace(reference=SimpleNamespace(arm=arm))
    link, sure, force = Pushed(alone, 15.0)._place(np.zeros(1), felt, one, one > 0.0)
    assert (link, sure) == (0, pytest.approx(1.0))
    assert force.mean[0] > 0.0 and not force.mean[1:].any()  # it stands up and turns about y


@dataclass(frozen=True)
class Placed:
    """Pushes of random strength and direction, and what was made of them."""

    right: np.ndarray  # (N,) the link told is the pushed one
    sure: np.ndarray  # (N,) [-] its confidence
    off: np.ndarray  # (N, 3) [-] error of the force, in its sd


@pytest.fixture(scope="module")
def placed(where: Space) -> Placed:
    rng, alone = np.random.default_rng(4), Pushed(where, 15.0)
    sd, told = np.array([2.0, 2.0, 1.5, 0.6, 0.6, 0.6]), []
    while len(told) < 400:
        q, link = rng.uniform(-2.5, 2.5, 6), int(rng.integers(1, 6))
        force = rng.standard_normal(3)
        force *= rng.uniform(60.0, 200.0) / np.linalg.norm(force)
        felt = -_lever(where, q, link, rng.uniform()).T @ force
        if np.sum((felt / sd) ** 2) < LOUD:
            continue
        felt += sd * rng.standard_normal(6)
        named, share, found = alone._place(q, felt, sd, np.ones(6, dtype=bool))
        told.append((named == link, share, (found.mean - force) / found.sd))
    right, sure, off = zip(*told, strict=True)
    return Placed(np.array(right), np.array(sure), np.array(off))


def test_a_confidence_in_a_link_is_how_often_it_is_that(placed: Placed) -> None:
    """Anywhere between its joint and the next.

    Of 400 draws, shares near .8 are within .07 of their mean by 3.5 sd.
    """
    assert placed.right.mean() > 0.7
    assert abs(placed.right.mean() - placed.sure.mean()) < 0.07


@pytest.mark.parametrize("link", [1, 2, 3, 4])
def test_where_two_links_meet_a_push_may_be_on_either(where: Space, link: int) -> None:
    """All of wrist 3 is where wrist 2 ends: it is the likelier, by as many points as were tried."""
    course = np.append(np.ones(5), np.zeros(CALM))
    event = _event(where, np.outer(course, -_lever(where, Q, link, 1.0).T @ FORCE))
    assert event.confidence < 0.85


def test_which_way_a_push_went_is_told_with_intervals_that_hold(placed: Placed) -> None:
    """An interval holds 90 % of each component; of 400 draws, .85 is 3.3 sd below that."""
    assert (np.abs(placed.off) < NORMAL90).mean(axis=0).min() > 0.85


def test_a_push_lasts_until_it_was_over_and_not_until_that_was_sure(where: Space) -> None:
    event = _event(where, _pushed(where, 4))
    assert event.evidence["duration_s"] == pytest.approx((8 - CALM) * BIN)


def test_a_force_is_as_sure_as_the_model_and_surer_than_before_it_was_felt(where: Space) -> None:
    """Six joints, each off by a share of its own, tell a known direction's force to 1/√6 of it."""
    exact, felt = np.full(6, 1e-3), -_lever(where, Q, 4, 0.5).T @ FORCE
    _, _, force = Pushed(where, 15.0)._place(Q, felt, exact, np.ones(6, dtype=bool))
    strength = np.linalg.norm(FORCE)
    along = np.sqrt(FORCE @ force.cov @ FORCE) / strength
    known = 1.0 / np.hypot(np.sqrt(6.0) / (MODEL * strength), 1.0 / BEFORE)
    assert known < along < 0.5 * BEFORE


def test_a_piece_that_is_there_when_it_seems_over_was_no_push(where: Space) -> None:
    still = np.zeros(6)
    tool = where.arm.regressor(Q, still, still)[..., -10:]
    torque = tool @ Payload(2.5, np.array([0.0, 0.0, 0.06])).inertials()
    held = np.outer(np.linspace(1.0, 0.6, 8), torque)
    assert _event(where, held) is None
    gone = held * (np.arange(8) < 8 - CALM)[:, None]
    assert _event(where, gone) is not None


def test_friction_that_rises_with_a_push_moves_no_link(where: Space) -> None:
    more = np.zeros((8, 6))
    more[:, 5] = 4.0  # of which a push on the link before knows nothing
    assert _event(where, _pushed(where, 4) + more).joint == 4


@pytest.mark.parametrize("pushed", [False, True])
def test_a_piece_that_is_let_go_of_for_a_moment_is_no_push_but_one_beside_it_is(
    where: Space, pushed: bool
) -> None:
    piece = Payload(4.0, np.array([0.0, 0.0, 0.08])).inertials()
    tool = where.arm.regressor(Q, np.zeros(6), np.zeros(6))[..., -10:]
    felt = np.outer(np.append([-0.5, -1.0, -1.2, -1.0, -0.5], np.zeros(CALM)), tool @ piece)
    felt += 0.5 * pushed * _pushed(where, 4)  # the piece explains more than half of both

    def event(*loads: np.ndarray):
        bins = tuple(replace(each, carried=piece) for each in _bins(where, felt))
        return Pushed(where, 15.0).event(bins, CALM, np.array(loads), np.zeros(6, dtype=bool))

    assert event(piece) is not None
    assert (event(piece, np.zeros(10)) is not None) == pushed


@pytest.mark.parametrize("pushed", [False, True])
def test_a_piece_that_is_lifted_off_is_no_push_but_one_beside_it_is(
    where: Space, pushed: bool
) -> None:
    """The tool bears ever more of it; when all is over it is there, and known for what it is."""
    piece = Payload(4.0, np.array([0.0, 0.0, 0.08])).inertials()
    tool = where.arm.regressor(Q, np.zeros(6), np.zeros(6))[..., -10:]
    share = np.clip(np.linspace(-0.2, 1.6, 8), 0.0, 1.0)
    felt = np.outer(share, tool @ piece) + pushed * _pushed(where, 4)
    felt[-CALM:] -= tool @ piece
    seen = tuple(
        replace(each, carried=piece * (k >= 8 - CALM)) for k, each in enumerate(_bins(where, felt))
    )
    event = Pushed(where, 15.0).event(seen, CALM, NOTHING, np.zeros(6, dtype=bool))
    assert (event is not None) == pushed
    if pushed:  # less what of it was along the piece's weight
        away = event.evidence["force_N"] - 0.87 * FORCE
        assert np.linalg.norm(away[:2]) < 0.3 * np.linalg.norm(FORCE)


def test_what_one_joint_says_in_one_bin_alone_is_no_push_but_two_or_twice_is(where: Space) -> None:
    felt = np.zeros((8, 6))
    felt[2, 1] = 40.0
    assert _event(where, felt) is None
    twice, two = felt.copy(), felt.copy()
    twice[3, 1], two[2, 2] = 40.0, 20.0
    assert _event(where, twice) is not None and _event(where, two) is not None


@pytest.mark.parametrize("rate", [20.0, 50.0, 125.0, pytest.param(500.0, marks=pytest.mark.slow)])
def test_one_value_that_is_off_is_no_push_at_any_rate_though_something_is_carried(
    shop: Shop, rate: float
) -> None:
    """At 500 Hz it has to be that large: a bin's mean has a twentieth of it."""
    log = shop.log("payload_change:onset=0,mass=1.5", seconds=8.0, rate=rate)
    current = log.joint("actual_current").copy()
    by = 8.0 if rate < 200.0 else 60.0
    for t, joint in ((3.0, 1), (5.0, 4), (7.0, 2)):
        current[np.searchsorted(log.t - log.t[0], t), joint] += by
    assert not [f for f in diagnose(shop.fit, with_current(log, current)) if f.kind == "collision"]


def test_friction_that_is_another_is_no_push(where: Space) -> None:
    """As much of what was felt as it may be; what is beyond it is told."""
    slack = np.array([-12.0, -15.0, -9.0, -3.0, -2.0, -3.0])
    felt = np.outer(np.append(np.ones(5), np.zeros(CALM)), slack)

    def event(by: float):
        bins = (replace(b, slack=np.array([slack, -slack])) for b in _bins(where, by * felt))
        return Pushed(where, 15.0).event(tuple(bins), CALM, NOTHING, np.zeros(6, dtype=bool))

    assert _event(where, felt) is not None
    assert event(1.0) is None and event(3.0) is not None


def test_a_push_that_jerks_the_arm_does_not_hide_behind_what_that_makes_doubtful(
    where: Space,
) -> None:
    """A prediction is off by its sd at random, not by as many of them as make noise a push."""
    felt = _pushed(where, 4)

    def event(of: float):
        bins = (
            replace(b, doubt=np.abs(row) / of)
            for b, row in zip(_bins(where, felt), felt, strict=True)
        )
        return Pushed(where, 15.0).event(tuple(bins), CALM, NOTHING, np.zeros(6, dtype=bool))

    assert event(2.0) is None
    assert event(4.0).joint == 4  # at most 4 joints by 4 sd each: 64 of the 90 of a push


@pytest.mark.parametrize(("way", "told"), [(-1.0, True), (1.0, False)])
def test_a_drive_that_holds_against_a_joint_that_gives_way_feels_a_push(
    shop: Shop, where: Space, way: float, told: bool
) -> None:
    """As much with it may be friction, which grows along the way that the joint crept."""
    n, drive, alone = 125, shop.dynamics.drive, Collision(where, read_rules().fast.collision)
    t, still = np.arange(6 * n) / n, np.zeros((6 * n, 6))
    pressed = np.clip(np.minimum(t - 2.0, 3.0 - t) / 0.4, 0.0, 1.0)[:, None]
    gives = 1.3e-3 * np.eye(6)[3]
    q = Q + way * pressed * gives
    go = Trajectory(t, Q + still, still, still)
    rng, lived = np.random.default_rng(3), happening(shop.dynamics, Work(go), (), False)
    log = observe(shop.dynamics, go, typical_sensors(shop.dynamics.arm), rng, lived)
    holds = 1.2 * pressed * (drive.coulomb / drive.gain * np.eye(6)[3])
    log = with_current(log, log.joint("actual_current") + holds)
    channels = {**log.channels, "actual_q": q, "actual_qd": np.gradient(q, 1.0 / n, axis=0)}
    motion, s, moved = shop.motion(replace(log, channels=channels))
    state, sound, felt = alone.init(), np.zeros(6, dtype=bool), False
    for at in range(0, len(motion) - 30, 30):
        part = slice(at, at + 30)
        beat = rows(where, motion.slice(at, at + 30), s[part], moved[part], unfelt(6))
        state, _ = alone.step(state, beat, NOTHING, sound)
        felt |= state.going
    assert felt == told


@pytest.mark.parametrize(("slack", "more", "other"), [(60.0, 45.0, False), (0.0, 0.0, True)])
def test_joints_that_friction_may_hold_otherwise_tell_of_no_other_load(
    where: Space, slack: float, more: float, other: bool
) -> None:
    """Only where a piece that is gone is missed beyond that is it over beside none."""
    alone, sound = Collision(where, read_rules().fast.collision), np.zeros(6, dtype=bool)
    (bare,) = _bins(where, np.zeros((1, 6)))
    piece = Payload(4.0, np.array([0.0, 0.0, 0.08])).inertials()
    laden = bare.tool @ piece
    loose = slack * np.array([-np.ones(6), np.ones(6)])
    gone = replace(bare, felt=bare.felt - laden, bare=bare.felt, slack=loose, carried=piece)
    begun = replace(gone, felt=gone.felt + more * np.eye(6)[2], slack=np.zeros((2, 6)))
    state = replace(alone.init(), carried=piece, bins=(begun,))
    after, _ = alone._judge(state, gone, np.array([piece, NOTHING[0]]), sound)
    assert bool((after.bins[-1].carried == 0.0).all()) == other
    assert after.calm == other


def test_friction_that_lets_go_of_an_arm_that_stands_is_no_push(shop: Shop, where: Space) -> None:
    """Joints that come to rest gently are slow for a while; then nothing holds them."""
    n, arm, drive = 125, shop.dynamics.arm, shop.dynamics.drive
    x = Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])(np.linspace(0.0, 1.0, 3 * n))
    way = np.concatenate([x, np.ones(2 * n)])
    q = Q + np.outer(way, np.array([0.9, 0.7, -0.5, 0.8, -0.6, 1.0]))
    v = np.gradient(q, 1.0 / n, axis=0)
    go = Trajectory(np.arange(len(q)) / n, q, v, np.gradient(v, 1.0 / n, axis=0))
    rng, lived = np.random.default_rng(3), happening(shop.dynamics, Work(go), (), False)
    log = observe(shop.dynamics, go, typical_sensors(arm), rng, lived)
    _, s, moved = shop.motion(log)
    lets_go = np.where(way[:, None] > 1.0 - 1e-6, drive.coulomb * s / drive.gain, 0.0)
    log = with_current(log, log.joint("actual_current") - lets_go)
    motion, alone = shop.motion(log)[0], Collision(where, read_rules().fast.collision)
    state, sound = alone.init(), np.zeros(arm.joints, dtype=bool)
    for at in range(0, len(motion) - 30, 30):
        of, part = motion.slice(at, at + 30), slice(at, at + 30)
        beat = rows(where, of, s[part], moved[part], unfelt(arm.joints))
        state, events = alone.step(state, beat, NOTHING, sound)
        assert not events and not state.going


def test_a_push_is_none_the_less_for_a_piece_that_it_was_taken_for(
    shop: Shop, where: Space
) -> None:
    """Who looks for pieces, half a second at a time, may take it for one before it is over."""
    log = shop.log(
        "collision:link=3,force=120/-60/90,onset=4,duration=0.3", seconds=6.0, rate=100.0
    )
    motion, s, moved = shop.motion(log)
    seen = rows(where, motion, s, moved, unfelt(6))
    alone, sound = Collision(where, read_rules().fast.collision), np.zeros(6, dtype=bool)

    def told(piece: np.ndarray) -> list[Event]:
        state, events = alone.init(), list[Event]()
        for k in range(0, len(motion), 20):
            now = seen.t[k] - log.t[0] > 4.15
            carried = np.array([piece, NOTHING[0]]) if now else NOTHING
            state, more = alone.step(state, seen.part(k, k + 20), carried, sound)
            events += more
        return events

    (event,) = told(NOTHING[0])
    strong = slice(*np.searchsorted(seen.t, event.onset + np.array([0.05, 0.25])))
    tool, felt = seen.tool[strong].reshape(-1, 10), seen.residual[strong].ravel()
    weight = where.noise.mean() ** -2.0
    precision = weight * tool.T @ tool + np.diag(ANYTHING**-2.0)
    piece = np.linalg.solve(precision, weight * tool.T @ felt)  # as a moment would have it
    assert [again.joint for again in told(piece)] == [event.joint]


def test_a_piece_that_was_felt_to_come_stays_until_moments_tell_of_it(
    shop: Shop, where: Space
) -> None:
    """Beside a baseline of its weight alone each time it is sped up would be a push."""
    piece = Payload(4.0, np.array([0.0, 0.0, 0.08])).inertials()
    log = shop.log("payload_change:mass=4,com=0/0/0.08,onset=4", seconds=7.0, rate=100.0)
    motion, s, moved = shop.motion(log)
    seen = rows(where, motion, s, moved, unfelt(6))
    alone, known = Collision(where, read_rules().fast.collision), np.array([NOTHING[0], piece])
    state, events = alone.init(), list[Event]()
    for k in range(0, len(motion), 20):
        state, more = alone.step(state, seen.part(k, k + 20), known, np.zeros(6, dtype=bool))
        events += more
        if seen.t[k] - log.t[0] > 4.5:
            np.testing.assert_array_equal(state.carried, piece)
    assert not events


def test_who_took_friction_for_a_push_is_not_deaf_to_one(shop: Shop, where: Space) -> None:
    """A joint is held by more, and goes: it told nothing, and what comes then begins for itself."""
    n, arm, drive = 125, shop.dynamics.arm, shop.dynamics.drive
    x = Polynomial([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])(np.linspace(0.0, 1.0, 2 * n))
    way = np.concatenate([np.zeros(2 * n), x, np.ones(n)])
    q = Q + np.outer(way, np.array([0.5, 0.4, -0.5, 0.8, -0.6, 1.0]))
    v = np.gradient(q, 1.0 / n, axis=0)
    go = Trajectory(np.arange(len(q)) / n, q, v, np.gradient(v, 1.0 / n, axis=0))
    rng, lived = np.random.default_rng(3), happening(shop.dynamics, Work(go), (), False)
    log = observe(shop.dynamics, go, typical_sensors(arm), rng, lived)
    t = log.t - log.t[0]
    held = 1.5 * drive.coulomb * (np.abs(t - 2.0) < 0.12)[:, None]
    course = np.where((t > 2.7) & (t < 2.95), 1.0, 0.0)
    torque = np.array([-_lever(where, at, 4, 0.5).T @ FORCE for at in q])
    current = log.joint("actual_current") + (held + course[:, None] * torque) / drive.gain
    motion, s, moved = shop.motion(with_current(log, current))
    alone, sound, events = Collision(where, read_rules().fast.collision), np.zeros(6, bool), []
    state, took, deaf = alone.init(), False, False
    for at in range(0, len(motion) - 30, 30):
        part = slice(at, at + 30)
        beat = rows(where, motion.slice(at, at + 30), s[part], moved[part], unfelt(6))
        state, more = alone.step(state, beat, NOTHING, sound)
        events += more
        end = beat.t[-1] - log.t[0]
        took |= state.going and end < 2.25
        deaf |= state.going and 2.4 < end < 2.7
    assert took and not deaf
    [event] = events
    assert abs(event.onset - log.t[0] - 2.7) < event.within < 0.2
    assert np.allclose(event.evidence["force_N"], FORCE, atol=0.2 * np.linalg.norm(FORCE))


@pytest.mark.parametrize("rises", [0.02, 0.6])
def test_a_push_that_rises_slowly_began_before_it_was_loud(shop: Shop, rises: float) -> None:
    log = shop.log(seconds=6.0, rate=100.0)
    t, drive, arm = log.t - log.t[0], shop.dynamics.drive, shop.dynamics.arm
    course = np.clip((t - 4.0) / rises, 0.0, 1.0) * (t < 4.8)
    q = log.joint("actual_q")
    lever = np.array([arm.jacobian(at, arm.link_names[4])[:3] for at in q])
    torque = course[:, None] * np.einsum("nij,i->nj", lever, FORCE)
    current = log.joint("actual_current") - torque / drive.gain
    [found] = diagnose(shop.fit, with_current(log, current))
    begin, end = np.array(found.onset_interval_s) - log.t[0]
    assert found.kind == "collision" and begin < 4.0 < end < begin + 0.7


def test_a_moment_with_a_push_is_not_learnt_from_though_the_arm_stands_afterwards(
    shop: Shop,
) -> None:
    """Be it that it stands for a while, as after a protective stop, or until the end."""
    log = shop.log(seconds=5.0)
    diagnosis = shop.diagnosis(log)
    known, state = rows(diagnosis.space, *shop.motion(log), unfelt(6)), diagnosis.init()
    beats = range(0, len(known), diagnosis.pace.beat)
    for at in beats:
        state, _ = diagnosis.take(state, known.part(at, at + diagnosis.pace.beat))
    *before, last = state.slow.waiting
    standing = replace(known, t=known.t + 5.0, current=np.full_like(known.current, np.nan))
    push = Push(False, last.begin, last.end)
    assert diagnosis.slow.moment(state.slow, standing, push).waiting == tuple(before)
    assert diagnosis.slow.concluded(state.slow, push).waiting == tuple(before)


def test_of_two_pushes_in_a_moment_none_is_forgotten() -> None:
    one, other = (Event("collision", 1, t, t + 0.1, 60.0, {}) for t in (2.0, 2.3))
    both = _told_of(_told_of(Push(), [one], True), [other], False)
    assert both == _told_of(Push(), [one, other], False)
    assert both.within(1.9, 1.95) and both.within(2.35, 2.5) and not both.going
