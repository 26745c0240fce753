"""What is carried is no fault of a joint, and what comes and goes is there to stay for nobody."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose import diagnose
from urdyn.diagnose.fast.collision import Collision
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.kinds.suspects import suspects
from urdyn.diagnose.load import carried
from urdyn.diagnose.load.carried import Mode, Shown
from urdyn.diagnose.load.carrying import MOMENT, Absence, Carrying, Waiting
from urdyn.diagnose.load.given_load import Belief
from urdyn.diagnose.load.lasting_load import LastingLoad
from urdyn.diagnose.load.loads import DELAY, Loads
from urdyn.diagnose.residual.moment import averaged, laden, pooled
from urdyn.diagnose.residual.rows import Rows, derivatives, rows
from urdyn.diagnose.residual.space import Space, space
from urdyn.diagnose.residual.warmth import felt, unfelt
from urdyn.diagnose.slow.slow import BLOCK
from urdyn.simulate import Payload
from urdyn.types import Log

PERIOD = 0.05  # [s]
PIECE = np.array([3.0, 0.0, 0.0, 0.24, 0.03, 0.0, 0.03, 0.0, 0.0, 0.01])


def work(shop: Shop, of: Space) -> Rows:
    """Some seconds of it beside the arm of a space."""
    motion, s, moved = shop.motion(shop.log(seconds=12.0, rate=1.0 / PERIOD))
    warmth = felt(unfelt(6), motion.t, motion.temperature)
    return rows(of, motion, s, moved, warmth)


def standing(shop: Shop, of: Space, n: int) -> Rows:
    """An arm that stands, and whose currents are those that were predicted, for n rows."""
    still = work(shop, of).part(100, 101)
    fields = {
        name: np.repeat(getattr(still, name), n, axis=0) for name in still.__dataclass_fields__
    }
    stood = Rows(**fields)
    return replace(stood, t=PERIOD * np.arange(n), v=np.zeros((n, 6)), current=stood.predicted)


def test_a_load_is_a_body_near_its_flange() -> None:
    """What a bias of a wrist's current looks like is none: .28 kg m, and no mass."""
    known, nothing = np.diag([0.02, *[0.01] * 3, *[1e-3] * 6]) ** 2, np.zeros(10)
    bodies = {(3.0, 0.24): True, (0.4, 0.2): True, (0.0, 0.28): False, (0.25, 0.32): False}
    for (mass, moment), may_be in bodies.items():
        mode = Mode(np.array([mass, 0.0, -moment, 0.0, *nothing[4:]]), known, 0.0)
        assert carried.possible(mode, nothing) is may_be
    lost = Mode(np.array([-1.0, 0.0, 0.0, -0.1, *nothing[4:]]), known, 0.0)
    assert carried.possible(lost, np.array([1.1, 0.0, 0.0, 0.11, *nothing[4:]]))
    assert not carried.possible(lost, nothing)


def test_a_moment_with_a_piece_is_that_of_an_arm_which_was_commissioned_with_it(shop: Shop) -> None:
    of = space(shop.fit)
    mine = of.reference
    its = replace(of, reference=replace(mine, payload=mine.payload + PIECE))
    one = laden(averaged(work(shop, of), PERIOD, of.noise), mine.drive, PIECE)
    other = averaged(work(shop, its), PERIOD, of.noise)
    there = one.weight > 0.0
    assert (np.sign(one.load) != np.sign(one.load - one.more * mine.drive.gain))[there].any()
    for name in ("residual", "load"):
        np.testing.assert_allclose(getattr(one, name)[there], getattr(other, name)[there])
    # but for the zeros of encoders, whose derivatives stay those of the arm without
    np.testing.assert_allclose(one.rigid[there][:, 6:], other.rigid[there][:, 6:], atol=1e-12)
    np.testing.assert_allclose(
        one.drive.swapaxes(1, 2)[there], other.drive.swapaxes(1, 2)[there], atol=1e-12
    )


def test_noise_of_accelerations_is_no_lack_of_a_pieces_inertia(shop: Shop) -> None:
    """What is left of a base's current beside a piece that is known, by that piece's inertia."""
    of, piece = space(shop.fit), Payload(6.0, np.array([0.0, 0.0, 0.08])).inertials()
    log = shop.log("payload_change:mass=6,com=0/0/0.08,onset=0", seconds=60.0)
    motion, s, moved = shop.motion(log)
    warmth = felt(unfelt(6), motion.t, motion.temperature)
    noise = np.random.default_rng(8).standard_normal(motion.a.shape)  # [rad/s²]

    def missing(a: np.ndarray, own: bool) -> float:
        """Of the piece's inertia, relative, by the motion's own accelerations or not."""
        means = averaged(rows(of, replace(motion, a=a), s, moved, warmth), 0.01, of.noise)
        means = laden(means, of.reference.drive, piece)
        columns, root = means.tool if own else means.rigid[..., -10:], np.sqrt(means.weight[:, 0])
        x = root * (columns @ piece)[:, 0]
        return -float(x @ (root * means.residual[:, 0]) / (x @ x))

    taken = [missing(motion.a + noise, own) - missing(motion.a, own) for own in (False, True)]
    # Noise is half of what a base's accelerations are: some .03 in 3000 rows, and .4 of itself.
    assert abs(taken[0]) < 0.1 < 0.2 < taken[1]


def test_no_column_has_the_noise_of_accelerations_that_is_in_what_is_left(shop: Shop) -> None:
    """Over half an hour at 500 Hz it had made a zero of an encoder in a healthy arm."""
    of, log = space(shop.fit), shop.log(seconds=10.0)
    motion, s, moved = shop.motion(log)
    warmth = felt(unfelt(6), motion.t, motion.temperature)
    noise = np.random.default_rng(9).standard_normal(motion.a.shape)  # [rad/s²]
    was = rows(of, motion, s, moved, warmth)
    now = rows(of, replace(motion, a=motion.a + noise), s, moved, warmth)
    # What gears lose goes by the sign of the load; at the ends nothing else tells accelerations.
    alike = (np.sign(now.load) == np.sign(was.load)) & np.isfinite(motion.instrument)
    alike = alike.all(axis=1)
    assert alike.mean() > 0.5
    np.testing.assert_allclose(now.rigid[alike], was.rigid[alike], rtol=1e-12)
    np.testing.assert_allclose(now.drive[alike], was.drive[alike], rtol=1e-12)


def test_a_gain_that_is_off_shows_in_a_piece_and_not_as_a_fault(shop: Shop) -> None:
    of, joint, off = space(shop.fit), 1, 0.06
    at, o, payload = of.places["gain"], of.places["o"], of.places["payload"]
    names = [f"{name}.gain" for name in of.arm.joint_names]
    np.testing.assert_allclose(
        np.sqrt(np.diag(of.cov)[at]),
        [shop.fit.spread(n) / shop.fit.value(n) for n in names],
        rtol=0.1,
    )
    held = laden(averaged(work(shop, of), PERIOD, of.noise), of.reference.drive, PIECE)
    told = held.residual.copy()
    told[:, joint] += off * held.more[:, joint]
    prior = of.cov + np.diag(read_rules().stray(of, "day") ** 2) + 1e-9 * np.eye(of.size)
    prior[at, at] = off**2 * np.eye(6)
    prior[payload, payload] = np.diag(carried.NOTHING**2)
    was, now = pooled(held), pooled(replace(held, residual=told))
    cov = np.linalg.inv(was.A + np.linalg.inv(prior))
    moved, sd = cov @ (now.b - was.b), np.sqrt(np.diag(cov))
    assert moved[at][joint] > 0.5 * off  # the prior pulls
    assert np.abs(moved[o] / sd[o]).max() < 1.0


def believed(of: Space) -> Belief:
    """In an arm that is as it was, but for its windows."""
    x, P = np.zeros(of.size), of.cov + np.diag(read_rules().stray(of, "window") ** 2)
    P[of.payload] = P[:, of.payload] = 0.0
    P[of.payload, of.payload] = carried.NOTHING**2
    return x, P


def with_pieces(loads: Loads, work: Rows, pieces: list[np.ndarray]) -> tuple[Waiting, ...]:
    """Moments of an arm that is as it was, and carries these."""
    told, of = [], loads.space
    for k, piece in enumerate(pieces):
        means = averaged(work.part(10 * k, 10 * k + 10), PERIOD, of.noise)
        means = replace(means, residual=np.zeros_like(means.residual))
        means = laden(means, of.reference.drive, -piece)
        moment = Waiting(means, pooled(means), (), k * MOMENT, (k + 1) * MOMENT, MOMENT)
        told.append(loads.given.told(moment, believed(of), [carried.commissioned()]))
    return tuple(told)


def test_a_piece_that_turns_a_load_over_is_weighed_as_it_is(shop: Shop) -> None:
    of, rules, at = space(shop.fit), read_rules(), slice(0, 4)
    drive = replace(of.reference.drive, structural=np.full(6, 0.2))
    of = replace(of, reference=replace(of.reference, drive=drive))
    loads, usual = Loads(of, suspects(of, rules.slow)), Carrying((carried.commissioned(),))
    moments = with_pieces(loads, work(shop, of), [PIECE] * (DELAY + 1))
    turned = [np.sign(laden(w.means, drive, PIECE).load) != np.sign(w.means.load) for w in moments]
    assert np.any(turned)
    now, _ = loads.carried(usual, lambda _: believed(of), moments)
    new = now.modes[now.now]
    anything = carried.anything(0.0)
    bent = carried.learnt(carried.together([w.told[0] for w in moments]), anything, 0.0)
    sd = np.sqrt(np.diag(new.cov))
    assert (np.abs(new.mean - PIECE) < 0.1 * sd)[at].all()
    assert (np.abs(bent.mean - PIECE) > sd)[at].any()


def test_a_piece_is_known_from_when_it_was_taken(shop: Shop) -> None:
    of, rules, taken = space(shop.fit), read_rules(), 2
    loads, usual = Loads(of, suspects(of, rules.slow)), Carrying((carried.commissioned(),))
    pieces = [np.zeros(10)] * taken + [PIECE] * (DELAY + 1 - taken)
    moments = with_pieces(loads, work(shop, of), pieces)
    now, after = loads.carried(usual, lambda _: believed(of), moments)
    assert now.path == (0,) * taken + (1,) * (DELAY + 1 - taken)
    assert abs(now.modes[1].mean[0] - PIECE[0]) < np.sqrt(now.modes[1].cov[0, 0])
    assert [len(w.told) for w in after] == [1] * taken + [2] * (DELAY + 1 - taken)
    again, _ = loads.carried(replace(usual, modes=now.modes), lambda _: believed(of), after)
    assert again.path == now.path and len(again.modes) == 2


def test_a_fault_of_a_joint_is_no_known_piece_put_down_though_some_poses_say_so(
    shop: Shop,
) -> None:
    of, elbow, n = space(shop.fit), 2, DELAY + 1
    loads, done = Loads(of, suspects(of, read_rules().slow)), work(shop, of)
    modes = carried.commissioned(), Mode(PIECE, np.diag(carried.NOTHING**2), 0.0)

    def path(piece: np.ndarray, bias: float) -> tuple[int, ...]:
        """What an arm that carried the piece is said to carry, where the elbow's current is off."""
        moments = []
        for moment in with_pieces(loads, done, [piece] * n):
            off = moment.means.residual + bias * (np.arange(6) == elbow)
            means = replace(moment.means, residual=off)
            moment = replace(moment, means=means, pool=pooled(means))
            moments.append(loads.given.told(moment, believed(of), modes))
        held = Carrying(modes, now=1, was=1)
        return loads.carried(held, lambda _: believed(of), tuple(moments))[0].path

    assert path(np.zeros(10), 0.0) == (0,) * n
    for bias in (-2.0, 2.0):  # [A]
        assert path(PIECE, bias) == (1,) * n


@pytest.mark.parametrize("size", [0.3, 3.0])  # [A]
def test_a_piece_is_weighed_by_no_jolt_that_brought_it(shop: Shop, size: float) -> None:
    of, taken = space(shop.fit), 2
    loads = Loads(of, suspects(of, read_rules().slow))
    usual = Carrying((carried.commissioned(),))
    pieces = [np.zeros(10)] * taken + [PIECE] * (DELAY + 1 - taken)
    before, shaken, *after = with_pieces(loads, work(shop, of), pieces)
    for jolt in np.random.default_rng(5).standard_normal((8, 6)):
        means = replace(shaken.means, residual=shaken.means.residual + size * jolt)
        moment = replace(shaken, means=means, pool=pooled(means))
        moment = loads.given.told(moment, believed(of), usual.modes)
        now, _ = loads.carried(usual, lambda _: believed(of), (before, moment, *after))
        assert now.path[taken:] == (1,) * len(after)
        assert abs(now.modes[1].mean[0] - PIECE[0]) < 3.0 * np.sqrt(now.modes[1].cov[0, 0])


def test_what_a_moment_says_of_a_load_is_its_likelihood(shop: Shop) -> None:
    of = space(shop.fit)
    means = averaged(work(shop, of).part(0, 10), PERIOD, of.noise)
    rest = np.setdiff1d(np.arange(of.size), of.payload)
    P = (of.cov + np.diag(read_rules().stray(of, "day") ** 2))[np.ix_(rest, rest)]
    x = 0.5 * np.sqrt(np.diag(P))
    held = laden(means, of.reference.drive, PIECE)
    told = carried.shown(pooled(held), of.payload, rest, x, P, PIECE)
    root = np.sqrt(held.weight).ravel()
    own = np.concatenate([held.drive, held.more[:, None]], axis=1)
    H = root[:, None] * derivatives(held.rigid, own).reshape(len(root), -1)
    cov = np.eye(len(root)) + H[:, rest] @ P @ H[:, rest].T
    for m in (PIECE, 0.5 * PIECE):
        off = root * held.residual.ravel() - H[:, rest] @ x - H[:, of.payload] @ (m - PIECE)
        direct = -0.5 * (off @ np.linalg.solve(cov, off) + np.linalg.slogdet(cov)[1])
        known = Mode(m, np.zeros((10, 10)), 0.0)
        np.testing.assert_allclose(carried.fit(told, known), direct, rtol=1e-6)


def test_a_load_is_weighed_no_surer_than_the_arm_is_known(shop: Shop) -> None:
    """By as much as least squares say, of all moments and of an arm that is the same in all."""
    of, n = space(shop.fit), 12
    loads, at = Loads(of, suspects(of, read_rules().slow)), of.payload
    moments = with_pieces(loads, work(shop, of), [PIECE] * n)
    mode = Mode(PIECE, np.zeros((10, 10)), 0.0)
    carrying = Carrying((carried.commissioned(), mode), 1, 1, (1,) * n)
    _, P = before = believed(of)
    for moment in moments:
        carrying, _ = loads.ripened(carrying, moment, before)
    prior = np.array(P)
    prior[np.ix_(at, at)] = np.diag(carried.ANYTHING**2)
    rows = [laden(w.means, of.reference.drive, carrying.modes[1].mean) for w in moments]
    A = np.sum([pooled(means).A for means in rows], axis=0)
    # (P^-1 + A)^-1 = P - P A (I + P A)^-1 P, for the prior is singular
    cov = np.linalg.solve(np.eye(of.size) + prior @ A, prior)
    assert carrying.weighed == pytest.approx(np.sqrt(cov[at[0], at[0]]), rel=0.01)
    assert carrying.weighed > 2.0 * np.sqrt(carrying.modes[1].cov[0, 0])
    assert carrying.here.whole is None


def test_a_load_in_the_place_of_another_has_not_been_carried_yet() -> None:
    told = moments(np.random.default_rng(1), np.zeros(3), 0.1)
    carrying = away(told, 1.0, 2.0, 3.0, whose=(1, 2, 3)).without(2)
    assert carrying.absent.tolist() == [0.0, MOMENT, 0.0, MOMENT]
    assert [one.mode for one in carrying.gone] == [1, 3]


def test_a_moment_that_a_gap_cut_short_counts_for_what_it_was(shop: Shop) -> None:
    log = shop.log(seconds=20.0)
    kept = np.arange(len(log)) % 21 < 15  # six of every 21 rows are lost
    log = Log(log.t[kept], {name: values[kept] for name, values in log.channels.items()})
    diagnosis = shop.diagnosis(log)
    state, _ = diagnosis.over(*shop.motion(log))
    assert 0.0 < state.slow.carrying.had <= 20.0 * kept.mean()


def moments(rng: np.random.Generator, load: np.ndarray, sd: float) -> tuple[Shown, ...]:
    """What moments say of these masses, (N,)."""
    C = np.diag(np.array([1.0, *[0.01] * 9]) * sd**-2)
    noise = C[0, 0] ** 0.5 * rng.standard_normal(len(load))
    return tuple(
        Shown(C, np.eye(10)[0] * (C[0, 0] * m + n)) for m, n in zip(load, noise, strict=True)
    )


def away(told: tuple[Shown, ...], *masses: float, whose: Sequence[int] = ()) -> Carrying:
    """Moments that went to modes of these masses, without more said all to the first."""
    modes = [Mode(np.eye(10)[0] * mass, 1e-4 * np.eye(10), 0.0) for mass in masses]
    each = list(whose) or [1] * len(told)
    gone = tuple(
        Absence(MOMENT * n, MOMENT, k, t) for n, (k, t) in enumerate(zip(each, told, strict=True))
    )
    times = tuple(MOMENT * each.count(k) for k in range(len(modes) + 1))
    now = each[-1]
    return Carrying(
        (carried.commissioned(), *modes), now, now, (now,), away=times, since=0.0, gone=gone
    )


@pytest.fixture(scope="module")
def stay(shop: Shop) -> LastingLoad:
    of, rules = space(shop.fit), read_rules()
    kind = next(kind for kind in rules.slow if kind.of_tool)
    return LastingLoad(of, suspects(of, rules.slow), kind)


def test_a_load_is_there_to_stay_and_a_piece_that_comes_and_goes_is_not(stay: LastingLoad) -> None:
    rng, n = np.random.default_rng(0), 60
    after, change = stay.settled(away(moments(rng, np.full(n, 0.5), 0.1), 0.5), 30.0)
    assert change is not None and change.size == 0.5
    assert after.modes[0].mean[0] == 0.5 and after.now == 0
    held = 1.0 * ((np.arange(n) // 8) % 2)
    after, change = stay.settled(away(moments(rng, held, 0.1), 0.5), 30.0)
    assert change is None
    assert abs(after.modes[1].mean[0] - 1.0) < 0.1
    assert not after.away


def test_of_two_loads_in_turn_each_is_told_since_it_came(stay: LastingLoad) -> None:
    """The first may be older than the run, and is lost from sight once the other has come."""
    rng, sd = np.random.default_rng(2), 0.1
    whose = [*[1] * 14, *[2] * 44]
    told = moments(rng, np.array([0.0, 1.2, 2.8])[whose], sd)
    after, change = stay.settled(away(told, 1.2, 2.8, whose=whose), 29.0)
    assert change is not None
    assert (change.size, change.older) == (1.2, True)
    assert (sum(after.away), after.since, after.last) == (22.0, 7.0, 7.0)
    after, change = stay.settled(after, 29.0)
    assert change is not None
    assert change.size == pytest.approx(1.6)
    assert (change.detail[0], change.older, change.onset) == (2.8, False, 7.0)
    assert change.began == (6.0, 7.5)
    assert not after.away


def test_a_load_after_a_lighter_one_that_was_there_shortly_began_with_the_run_no_more(
    stay: LastingLoad,
) -> None:
    rng, whose = np.random.default_rng(3), [*[1] * 4, *[2] * 40]
    told = moments(rng, np.array([0.0, 1.2, 2.8])[whose], 0.1)
    _, change = stay.settled(away(told, 1.2, 2.8, whose=whose), 22.0)
    assert change is not None
    assert (change.size, change.older, change.onset) == (2.8, False, 2.0)


def test_pieces_that_a_tool_handles_which_nobody_knows_hide_it_not(stay: LastingLoad) -> None:
    rng, whose = np.random.default_rng(4), (1 + (np.arange(60) // 8) % 2).tolist()
    told = moments(rng, np.array([0.0, 1.2, 2.8])[whose], 0.1)
    after, change = stay.settled(away(told, 1.2, 2.8, whose=whose), 30.0)
    assert change is not None
    assert (change.size, change.older) == (1.2, True)
    assert after.handles
    assert stay.settled(after, 30.0, ended=True)[1] is None


def test_a_load_that_came_after_an_older_one_is_told_beside_that(shop: Shop) -> None:
    loads = (f"payload_change:mass={m},com=0/0/0.05,onset={t}" for m, t in ((1.2, 0), (2.8, 6)))
    first, second = shop.report(*loads, seconds=32.0)
    assert first.older
    assert not second.older
    assert abs(first.size - 1.2) < 3.0 * first.size_sd
    assert abs(second.size - 1.6) < 3.0 * second.size_sd
    assert second.onset_interval_s[0] < 6.0 < second.onset_interval_s[1]


def test_a_load_that_moments_hardly_tell_has_to_stay_longer(stay: LastingLoad) -> None:
    rng, least = np.random.default_rng(1), stay.kind.hold
    clear = 0.5 * 5 * 0.5**2 / 0.3**2  # nats in five moments of a load of .5 kg with sd .3 kg
    needed = least * (carried.SURE + 10.0) / clear
    assert needed > 2.0 * least
    for time, told in ((least + 1.0, False), (0.9 * needed, False), (1.1 * needed, True)):
        some = moments(rng, np.full(round(time / MOMENT), 0.5), 0.3)
        assert (stay.settled(away(some, 0.5), time)[1] is not None) is told


@pytest.mark.parametrize(("onset", "told"), [(0.0, True), (8.0, True), (14.0, False)])
def test_what_a_recording_shows_to_its_end_needs_less_patience(
    shop: Shop, onset: float, told: bool
) -> None:
    """A piece may have been gripped a few seconds ago."""
    found = shop.report(f"payload_change:mass=2,onset={onset}", seconds=20.0, rate=25.0).findings
    assert [f.kind for f in found] == ["payload_change"] * told
    for f in found:
        assert f.older is (onset == 0.0) and abs(f.size - 2.0) < 3.0 * f.size_sd


def test_a_load_that_was_changed_while_the_arm_stood_came_at_any_time_of_that(shop: Shop) -> None:
    """Nobody saw when; what was carried before the rest, and after it, tells no more."""
    log = shop.log("payload_change:mass=2,onset=12", seconds=44.0, rate=25.0)
    t = np.where(log.t < 12.0, log.t, log.t + 30.0)
    (finding,) = diagnose(shop.fit, replace(log, t=t)).findings
    lo, hi = finding.onset_interval_s
    assert not finding.older
    assert 11.0 < lo < 12.0 and 42.0 < hi < 44.0


def test_what_holds_a_standing_joint_is_not_predicted(shop: Shop) -> None:
    """Velocities that are not quite zero let it creep, where they are integrated."""
    of, n = space(shop.fit), 100
    drive, stood = of.reference.drive, standing(shop, of, n)
    grip = np.stack([drive.coulomb, drive.structural * np.abs(stood.load[0])]) / drive.gain
    s = np.where((np.arange(n) >= 40) & (np.arange(n) < 50), 1.0, -1.0)[:, None]
    own = stood.drive.copy()
    own[:, 0], own[:, 2] = s * grip[0], s * grip[1]
    crept = replace(stood, drive=own, predicted=stood.predicted + s * grip.sum(axis=0))
    own = own.copy()
    own[:, 0], own[:, 2] = -grip[0], -grip[1]
    held = replace(stood, drive=own, predicted=stood.predicted - grip.sum(axis=0))
    test = Collision(of, read_rules().fast.collision)

    def told(beside: Rows) -> list[str]:
        nobody, well = np.zeros((1, 10)), np.zeros(6, dtype=bool)
        return [push.kind for push in test.step(test.init(), beside, nobody, well)[1]]

    assert told(replace(crept, current=held.predicted)) == []
    assert told(replace(held, current=2.0 * held.predicted - crept.predicted)) == ["collision"]


def test_a_pause_ends_a_block_for_the_next_program_may_be_another(shop: Shop) -> None:
    log = shop.log(seconds=14.0, rate=1.0 / PERIOD)
    motion, s, moved = shop.motion(log)
    diagnosis, half, pause = shop.diagnosis(log), 7.0, 60.0
    state = diagnosis.init()
    for k in range(0, len(motion), 5):
        here = motion.slice(k, min(k + 5, len(motion)))
        later = replace(here, t=here.t + pause * (here.t[0] > half))
        beat = rows(diagnosis.space, later, s[k : k + 5], moved[k : k + 5], unfelt(6))
        state, _ = diagnosis.take(state, beat)
    blocks = state.slow.recall.blocks
    assert len(blocks) >= 2
    assert max(block.end - block.begin for block in blocks) < BLOCK + 1.0
    assert 0.0 < state.slow.before[0].t < half + 1.0


def test_whoever_learns_what_is_carried_has_not_felt_a_push(shop: Shop) -> None:
    of, n = space(shop.fit), 100
    stood = standing(shop, of, n)
    test, well = Collision(of, read_rules().fast.collision), np.zeros(6, dtype=bool)
    state = test.init()
    for k in range(0, n, 5):
        thought = PIECE * (40 <= k < 50)
        state, pushes = test.step(state, stood.part(k, k + 5), thought[None], well)
        assert pushes == [] and not state.going


def test_what_lasts_is_no_push_whatever_is_taken_to_be_carried_meanwhile(shop: Shop) -> None:
    of, n, longest = space(shop.fit), 160, read_rules().fast.collision.longest
    stood = standing(shop, of, n)
    pressed = np.outer(stood.t > 1.0, 60.0 / of.reference.drive.gain)
    stood = replace(stood, current=stood.predicted + pressed)
    test, well = Collision(of, read_rules().fast.collision), np.zeros(6, dtype=bool)
    state, going = test.init(), []
    for k in range(0, n, 5):
        thought = PIECE * (k < 40)
        state, pushes = test.step(state, stood.part(k, k + 5), thought[None], well)
        assert pushes == []
        going.append(state.going)
    over = round((1.0 + longest) / PERIOD) // 5 + 2
    assert any(going) and not any(going[over:])
