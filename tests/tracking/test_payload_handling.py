"""Pieces that are too light for evidence within one hold spoil nothing that an arm has learnt."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from workshop import Workshop, commissioned

from urdyn.estimate import EKF
from urdyn.identify import Fit
from urdyn.model.dynamics import Dynamics
from urdyn.signal import samples
from urdyn.simulate import (
    happening,
    observe,
    parse_fault,
    perfect_sensors,
    plan,
    real_sensors,
    typical_sensors,
)
from urdyn.simulate.limits import comfortable
from urdyn.simulate.moves import Move, one_after_the_other
from urdyn.simulate.payload import Payload
from urdyn.simulate.schedule import Handling
from urdyn.simulate.trajectory import grid
from urdyn.simulate.work import Work, pick_and_place
from urdyn.tracking import Tracker
from urdyn.tracking.belief.physical import KNOWN
from urdyn.tracking.step.payload_handling import (
    HANDLING,
    LEARNT,
    REST,
    ImplausibleLoads,
    Rest,
    exchanged,
)
from urdyn.types import Log

RATE = 20.0  # [Hz] at which a hold tells little


def drive_at_the_end(
    dynamics: Dynamics, fit: Fit, log: Log, joint: int, times: float, group: str = "f"
) -> tuple[np.ndarray, np.ndarray, int]:
    """How far its logarithm is off, its sd (J,), and how often another payload was told.

    Args:
        log: in which the friction, or health, of `joint` has become so many `times` what it was.
    """
    tracker, widened = Tracker(fit, EKF(), float(np.median(np.diff(log.t)))), 0
    state, at = tracker.init(), tracker.currents.places[group]
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        widened += reading is not None and reading.widened
    healthy = np.log(dynamics.drive.coulomb) if group == "f" else 0.0
    off = state.belief.mean[at] - healthy
    off[joint] -= np.log(times)
    return off, state.belief.sd[at], widened


def befallen(dynamics: Dynamics, work: Work, fault: str, rng: np.random.Generator) -> Log:
    """What is recorded of work in which a fault comes at once."""
    lived = happening(dynamics, work, (parse_fault(f"{fault},shape=step", 6),), False)
    return observe(dynamics, work.trajectory, real_sensors(dynamics.arm), rng, lived)


def test_a_rest_is_one_after_which_something_else_may_be_carried() -> None:
    rest = Rest()
    while rest.lasted < 0.8 * REST:
        assert not rest.ends(True)
        rest = rest.after(False, 0.05, rest.left, 6.0)
    rest = rest.after(False, REST, rest.left, 6.9)
    assert rest.ends(True) and not rest.ends(False) and not rest.just(7.0)
    off = rest.after(True, 0.05, 7.0, 7.0)
    assert not off.lasted
    assert off.just(7.0 + 0.9 * LEARNT) and not off.just(7.0 + 1.1 * LEARNT)
    assert not off.known(7.0 + 0.9 * LEARNT) and off.known(7.0 + 1.1 * LEARNT)
    assert not rest.known(1e9)


@pytest.mark.parametrize(("lasts", "rests"), [(0.1, False), (REST, True), (3600.0, True)])
def test_a_gap_may_hide_a_rest_in_which_something_was_gripped(
    workshop: Workshop, lasts: float, rests: bool
) -> None:
    """An arm that moves before it and after it: what is light may be carried from then on."""
    tracker = Tracker(workshop.fit, EKF(), 0.01)
    state, told = tracker.init(), list(samples(workshop.log.slice(0, 80)))
    for sample in told[:40]:
        state, reading = tracker.step(state, sample)
        assert reading is None or reading.inputs.taken is None
    off = []
    for sample in told[40:]:
        state, reading = tracker.step(state, replace(sample, t=sample.t + lasts))
        off += [] if reading is None else [reading.inputs.taken is not None]
    assert off == [rests] + [False] * (len(off) - 1)


def test_what_is_known_worse_must_be_further_apart() -> None:
    nothing, sd = np.zeros(10), np.full(10, 0.1)
    one = np.array([0.7, *nothing[1:]])
    assert exchanged((nothing, sd), (one, sd))
    assert not exchanged((nothing, sd), (one, 3.0 * sd))


@pytest.mark.parametrize(
    ("mass", "seed"),
    [
        (0.3, 5),
        pytest.param(0.6, 4, marks=pytest.mark.slow),
        pytest.param(0.8, 5, marks=pytest.mark.slow),
        pytest.param(1.5, 4, marks=pytest.mark.slow),
        pytest.param(2.2, 4, marks=pytest.mark.slow),
    ],
)
def test_light_pieces_are_weighed_and_spoil_no_drive(mass: float, seed: int) -> None:
    """A story: in one hold at 20 Hz, under real noise, they hardly tell more than they might not.

    When it was evidence alone that told of pieces, 1.5 kg were taken for something between that and
    nothing, four holds of five were outside their 90 %, and health was twelve deviations off; of
    .3 and .6 kg, which no evidence tells within a hold, every hold was.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng(seed)
    piece = Payload(mass, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(dynamics.arm, 140.0, RATE, rng, piece)
    log = observe(dynamics, work.trajectory, real_sensors(dynamics.arm), rng, work.handling)
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state, at, told = tracker.init(), tracker.currents.places, []
    for sample in samples(log):
        state, _ = tracker.step(state, sample)
        mean, sd = state.belief.mean[at["payload"]][0], state.belief.sd[at["payload"]][0]
        told.append((sample.t, mean, sd))
    t, mean, sd = np.array(told).T
    [handling] = work.handling
    ends = np.searchsorted(t, handling.begin[5:]) - 1  # of holds, when the program is known
    off = mean[ends] - handling.carried[4:-1, 0]
    inside = np.abs(off) < 1.645 * sd[ends]
    # Holds share what the twin does not know, so that no binomial bounds it from above.
    assert inside.mean() > 0.75
    assert (np.abs(off) < 4.0 * sd[ends]).all()
    z = at["z"]
    assert (np.abs(state.belief.mean[z]) < 3.5 * state.belief.sd[z]).all()


def test_the_first_piece_that_is_put_down_teaches_nothing_of_drives() -> None:
    """A story: an arm exactly as commissioned, noiseless; 4 kg for one move, then none for another.

    The load of the first move was known to no belief to roll back to, and the loss of it was taken
    for a light piece and for drives, two thirds of a deviation off. Where every move is with
    another load, nothing corrects them: all holds were weighed .1 kg too light, and none .1 kg.
    """
    _, fit = commissioned(0)
    arm, place = fit.dynamics.arm, np.array([0.2, -1.3, 1.6, -1.8, -1.5, 0.3])
    other = place + np.array([0.9, 0.2, -0.35, 0.2, 0.1, 0.5])
    moves = [Move(0.45, 1.05, place, other), Move(1.95, 1.05, other, place)]
    way = one_after_the_other(moves, grid(2.8, 50.0))
    piece = np.array([4.0, 0, 0, 0.32, 0.0256, 0, 0.0256, 0, 0, 0])
    held = Handling(np.array([0.2, 1.75]), np.array([piece, 0.0 * piece]))
    rng = np.random.default_rng(0)
    log = observe(fit.dynamics, way, perfect_sensors(arm), rng, (held,))
    tracker = Tracker(fit, EKF(), 1.0 / 50.0)
    state, at, told = tracker.init(), tracker.currents.places, []
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        told += [reading.t] if reading is not None and reading.widened else []
    off = np.abs(state.belief.mean - tracker.model.prior.mean) / state.belief.sd
    assert all((off[at[group]] < 0.1).all() for group in ("f", "beta", "z"))
    assert np.abs(state.belief.mean[at["payload"]][0]) < 0.05
    assert len(told) == 1 and told[0] > 1.95


def test_what_is_carried_is_known_two_seconds_after_it_was_last_doubted_and_no_sooner() -> None:
    """Another piece, told a second after the arm set off, has shown itself for the other one alone.

    Taken for known then, it was the piece before, now and then, for the rest of a hold; what is
    linear around it was off with it, in every hold of a program alike, and within ten minutes
    friction, damping and health of all joints rose together by three deviations.
    """
    dynamics, fit = commissioned(0)
    rng, piece = np.random.default_rng(3), Payload(1.7, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(dynamics.arm, 60.0, RATE, rng, piece)
    log = observe(dynamics, work.trajectory, real_sensors(dynamics.arm), rng, work.handling)
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state, told, late = tracker.init(), -np.inf, 0
    for sample in samples(log):
        before = state
        state, _ = tracker.step(state, sample)
        if state.widened > before.widened > 0.0:
            assert state.rest.left == state.t
            told, late = state.t, late + (before.rest.left < state.t - 0.5)
        assert np.isfinite(state.rest.left) or told < state.t - LEARNT or np.isinf(told)
    assert late  # some were told well after the arm had set off


def test_an_arm_that_stops_knows_what_it_carries_as_well_as_when_it_moved() -> None:
    """A story: from point to point with a piece, and moves of two seconds or so.

    What had been weighed was taken to be anything anew two seconds after an arm had set off, by
    when it stood as often as not: it went on to carry 2 ± 49 kg until it moved again.
    """
    dynamics, fit = commissioned(0)
    rng, piece = np.random.default_rng(2), np.array([2.0, 0, 0, 0.16, 0.02, 0, 0.02, 0, 0, 2e-3])
    work = plan("point_to_point", dynamics.arm, 60.0, 50.0, rng)
    held = Handling(np.array([10.0]), np.array([piece]))
    lived = happening(dynamics, replace(work, handling=(held,)), (), False)
    log = observe(dynamics, work.trajectory, typical_sensors(dynamics.arm), rng, lived)
    tracker = Tracker(fit, EKF(), 1.0 / 50.0)
    state, at, told = tracker.init(), tracker.currents.places["payload"], []
    for sample in samples(log):
        state, _ = tracker.step(state, sample)
        if state.rest.lasted and state.rest.over > 12.0:
            told.append((state.belief.mean[at][0], state.belief.sd[at][0]))
    mean, sd = np.array(told).T
    assert len(told) > 300
    assert (sd < KNOWN).all()
    assert (np.abs(mean - piece[0]) < 4.0 * sd).all()


@pytest.mark.slow
def test_a_piece_that_was_put_down_is_not_believed_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """A story: holds of three seconds at 20 Hz, after which .6 kg can hardly be told from nothing.

    When what was carried before was believed in until it was surely something else, it was so in
    nineteen of twenty empty holds. In a day of such programs a wrist's health was told by a weight
    that was not there, and was five deviations off after fifteen hours.
    """
    quick = partial(comfortable, excursion=1.0, velocity=1.5, acceleration=8.0)
    monkeypatch.setattr("urdyn.simulate.work.comfortable", quick)
    dynamics, fit = commissioned(0)
    rng, mass = np.random.default_rng(3), 0.6
    work = pick_and_place(dynamics.arm, 200.0, RATE, rng, Payload(mass, np.array([0.0, 0.0, 0.08])))
    log = observe(dynamics, work.trajectory, real_sensors(dynamics.arm), rng, work.handling)
    tracker, [handling] = Tracker(fit, EKF(), 1.0 / RATE), work.handling
    state, believed = tracker.init(), []
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is None or np.isfinite(state.rest.left) or state.rest.lasted:
            continue
        hold = np.searchsorted(handling.begin, reading.t) - 1
        if hold > 5 and not handling.carried[hold, 0] and reading.t > handling.begin[hold] + 0.5:
            believed.append(state.payload[0] > 0.5 * mass)
    assert len(believed) > 200
    # For two seconds after a hold nobody asks what is carried, and in such a program that is most.
    assert np.mean(believed) < 0.5


@pytest.mark.slow
def test_friction_that_jumps_is_followed_where_every_grip_leaves_half_a_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A story: a quick program, of which two seconds after every grip tell of what is carried.

    When evidence of a drive's trouble began anew with every grip, nothing was told of it for
    minutes, and friction was 23 deviations off.
    """
    quick = partial(comfortable, excursion=0.5, velocity=0.6, acceleration=6.0)
    monkeypatch.setattr("urdyn.simulate.work.comfortable", quick)
    dynamics, fit = commissioned(0)
    rng, piece = np.random.default_rng(1), Payload(0.5, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(dynamics.arm, 120.0, 100.0, rng, piece)
    fault = parse_fault("friction_increase:joint=1,onset=60,rate=0.4,shape=step", 6)
    lived = happening(dynamics, work, (fault,), False)
    log = observe(dynamics, work.trajectory, typical_sensors(dynamics.arm), rng, lived)
    off, sd, _ = drive_at_the_end(dynamics, fit, log, 1, 1.4)
    assert (np.abs(off) < 4.0 * sd).all() and sd[1] < 0.1


def test_gears_are_loaded_as_what_is_carried_says_and_not_as_its_noisy_estimate_does() -> None:
    """A wrist that bears nothing would find in its noise that it rubs the more the more it bears.

    Just after a grip the estimate of a payload is what the noise of a few currents makes of it. If
    that told which way the gears are loaded, the noise would be in what structural damping
    multiplies: its logarithm was eight deviations too high after two hours of ever new pieces.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng(2)
    piece = Payload(2.0, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(dynamics.arm, 60.0, RATE, rng, piece)
    log = observe(dynamics, work.trajectory, typical_sensors(dynamics.arm), rng, work.handling)
    tracker = Tracker(fit, EKF(), 1.0 / RATE)
    state, at, looked = tracker.init(), tracker.currents.places, 0
    for sample in samples(log):
        before, (state, reading) = state, tracker.step(state, sample)
        if reading is None or state.payload is not before.payload:
            continue
        x = np.array(before.belief.mean[: len(tracker.currents.names)])
        x[at["payload"]] = state.payload
        u, rigid = reading.inputs, tracker.currents.rigid
        load, held = u.load + u.A @ x[rigid], u.hold + u.A_hold @ x[rigid]
        np.testing.assert_allclose(held, u.s * np.abs(load), rtol=1e-9, atol=1e-12)
        looked += 1
    assert looked > 0.9 * len(log)


def test_healthy_holds_are_seldom_less_than_nothing_and_loads_that_turn_over_always() -> None:
    rng, weighed, told = np.random.default_rng(4), ImplausibleLoads(), 0
    for hold in range(2000):  # of an arm that carries nothing
        weighed = weighed.after(0.05 * rng.standard_normal(), 0.05, float(hold))
        told += weighed.told == hold
    assert told <= 2
    weighed, at = ImplausibleLoads(), 5000.0
    for hold in range(8):  # of one whose friction has grown
        weighed = weighed.after(0.2 * (-1.0) ** hold, 0.05, at + hold)
    assert weighed.suspected(at + 8.0) and not weighed.suspected(at + 8.0 + HANDLING)


UNSETTLED = pytest.mark.xfail(reason="a drive and a light load go on to be told anew at each rest")


@pytest.mark.slow
@pytest.mark.parametrize("joint", [pytest.param(1, marks=UNSETTLED), 2])
def test_friction_that_grows_between_rests_is_no_load_that_turns_over(joint: int) -> None:
    """A story: an arm that carries nothing goes from point to point, and a joint's friction jumps.

    Every move could be one with another light load, of this sign or that. While that was looked
    for without end, such loads were told up to 84 times in a run, and friction never.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng(2)
    work = plan("point_to_point", dynamics.arm, 90.0, 100.0, rng)
    log = befallen(dynamics, work, f"friction_increase:joint={joint},onset=30,rate=0.3", rng)
    off, sd, widened = drive_at_the_end(dynamics, fit, log, joint, 1.3)
    assert (np.abs(off) < 4.0 * sd).all() and sd[joint] < 0.03
    assert widened < 8


@pytest.mark.parametrize(
    ("joint", "unsure"), [(4, 0.13), pytest.param(5, 0.2, marks=pytest.mark.slow)]
)
def test_a_wrist_s_friction_is_not_what_it_bears(joint: int, unsure: float) -> None:
    """A story: at 20 Hz a wrist's friction jumps, and structural damping is known worse than that.

    It took all of it, and friction was eleven deviations off. Of another wrist a load that turns
    over took it: drives were not asked before it had been carried for two seconds, which it never
    was, and friction was as far off for good.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng(3)
    work = plan("point_to_point", dynamics.arm, 120.0, RATE, rng)
    log = befallen(dynamics, work, f"friction_increase:joint={joint},onset=50,rate=0.3", rng)
    off, sd, _ = drive_at_the_end(dynamics, fit, log, joint, 1.3)
    assert (np.abs(off) < 4.0 * sd).all() and sd[joint] < unsure
    assert abs(off[joint]) < 0.5 * np.log(1.3)


@pytest.mark.parametrize(
    ("joint", "unsure"), [pytest.param(1, 0.025, marks=pytest.mark.slow), (2, 0.04)]
)
def test_a_little_health_is_no_light_load(joint: int, unsure: float) -> None:
    """A story: a drive loses a twelfth of its health, long after it set out.

    A possible load of .3 kg and a zero took it, and health was twelve deviations off.
    How soon the load is ruled out is the noise's luck: the elbow is left unsure by .008 to .034.
    """
    dynamics, fit = commissioned(0)
    rng = np.random.default_rng(3)
    work = plan("point_to_point", dynamics.arm, 120.0, RATE, rng)
    log = befallen(dynamics, work, f"health_degradation:joint={joint},onset=60,rate=0.08", rng)
    off, sd, _ = drive_at_the_end(dynamics, fit, log, joint, 0.92, "z")
    assert (np.abs(off) < 4.0 * sd).all() and sd[joint] < unsure


@pytest.mark.slow
def test_one_piece_does_not_stop_a_quick_arm_from_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    """A story: a piece is carried for ten seconds and never again, and no move lasts two seconds.

    For five minutes every rest took back what the last move had taught, though it was known well
    enough by then that nothing is carried; and intervals stayed as narrow as they were.
    """
    quick = partial(comfortable, excursion=0.7, velocity=0.9, acceleration=6.0)
    monkeypatch.setattr("urdyn.simulate.moves.comfortable", quick)
    dynamics, fit = commissioned(0)
    rng, piece = np.random.default_rng(2), np.array([1.5, 0, 0, 0.12, 0.01, 0, 0.01, 0, 0, 1e-3])
    work = plan("point_to_point", dynamics.arm, 90.0, 100.0, rng)
    held = Handling(np.array([10.0, 20.0]), np.array([piece, 0.0 * piece]))
    work, fault = replace(work, handling=(held,)), "friction_increase:joint=1,onset=35,rate=0.4"
    log = befallen(dynamics, work, fault, rng)
    off, sd, _ = drive_at_the_end(dynamics, fit, log, 1, 1.4)
    assert (np.abs(off) < 4.0 * sd).all() and sd[1] < 0.03
