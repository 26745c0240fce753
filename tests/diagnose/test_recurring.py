"""What recurs where a joint turns over is play, however a loop answers it; a push is no play."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from realarm import Recorded, with_current
from scipy.special import logsumexp
from scipy.stats import invwishart, multivariate_t
from shop import Shop

from urdyn.diagnose import diagnose
from urdyn.diagnose.fast.recurrence import FEWEST, LATE, LIKELY, RECURS, aligned, ratios
from urdyn.diagnose.fast.recurring import (
    BEFORE,
    BIN,
    BINS,
    BRISK,
    PATTERN,
    Recurring,
    _apart,
    _window,
    at_first,
    faded,
    slides,
    unjolted,
)
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.residual.rows import COULOMB, ROTOR, Rows
from urdyn.diagnose.residual.space import space
from urdyn.identify import Fit
from urdyn.tracking.step.joint_motion import STANDING
from urdyn.types import Array, Log

DOF, SOUND = 40.0, 25.0


def _jolts(log: Log, x: Array, jolt, since: float = 0.0) -> Array:
    """A jolt where x (N,) turns over, signed as it does, (N,).

    Args:
        jolt: of the time since [s].
        since: after the first sample [s].
    """
    t, many = log.t, round(0.06 / float(np.median(np.diff(log.t))))
    x = np.convolve(x, np.full(many, 1.0 / many), "same")
    turned = np.flatnonzero((x[1:] * x[:-1] < 0.0) & (t[1:] > t[0] + since))
    firm = [k for k in turned if abs(x[k + many] - x[k - many]) > 0.02]  # it does not stand
    return np.asarray(sum(np.sign(x[k + 1]) * jolt(t - t[k]) for k in firm))


def _within(after: Array, begin: float, end: float) -> Array:
    return np.where((after >= begin) & (after < end), 1.0, 0.0)


def _blow(after: Array) -> Array:
    return _within(after, 0.03, 0.08)


def _rebound(after: Array) -> Array:
    return _within(after, 0.05, 0.08) - _within(after, 0.0, 0.05)


def test_evidence_is_that_of_windows_one_by_one() -> None:
    """Each is of a t distribution, given those before it [Murphy2007]."""
    rng = np.random.default_rng(1)
    Psi, y = invwishart.rvs(DOF, np.eye(PATTERN), random_state=rng), rng.normal(size=(7, PATTERN))

    def one_by_one(latest: Array, k: float) -> float:
        mean, scale, dof, told = np.zeros(PATTERN), Psi, DOF, 0.0
        for each in latest:
            free = dof - PATTERN + 1.0
            shape = scale * (k + 1.0) / (k * free)
            told += multivariate_t.logpdf(each, mean, shape, free)
            scale = scale + k / (k + 1.0) * np.outer(each - mean, each - mean)
            mean, k, dof = (k * mean + each) / (k + 1.0), k + 1.0, dof + 1.0
        return told

    for n, ratio in enumerate(ratios(y, Psi, DOF, SOUND), start=FEWEST):
        recurs = logsumexp([one_by_one(y[-n:], k) for k in RECURS]) - np.log(len(RECURS))
        assert ratio == pytest.approx(recurs - one_by_one(y[-n:], SOUND), abs=1e-8)


def test_sound_windows_keep_the_promise() -> None:
    """Once in so many is evidence as much as that, at the most: a binomial's 4 sd."""
    rng, draws, once = np.random.default_rng(2), 2000, 100.0
    Psi = (DOF - PATTERN - 1.0) * np.eye(PATTERN)
    alarms = 0
    for C in invwishart.rvs(DOF, Psi, size=draws, random_state=rng):
        root = np.linalg.cholesky(C)
        d = root @ rng.normal(size=PATTERN) / np.sqrt(SOUND)
        alarms += ratios(d + rng.normal(size=(12, PATTERN)) @ root.T, Psi, DOF, SOUND)[-1] > np.log(
            once
        )
    assert alarms <= draws / once + 4.0 * np.sqrt(draws / once)


def test_sound_windows_keep_the_promise_wherever_they_are_most_alike() -> None:
    """The same of windows that may be early or late."""
    rng, draws, once = np.random.default_rng(3), 2000, 100.0
    alarms = 0
    for _ in range(draws):
        y = rng.normal(size=(12, len(LATE), PATTERN)) + rng.normal(size=PATTERN) / np.sqrt(SOUND)
        chosen, placed = aligned(y, np.eye(PATTERN))
        ratio = ratios(chosen, DOF * np.eye(PATTERN), DOF + PATTERN + 1.0, SOUND)[-1]
        alarms += ratio + placed[-1] > np.log(once)
    assert alarms <= draws / once + 4.0 * np.sqrt(draws / once)


def test_windows_are_placed_where_they_are_alike() -> None:
    """Apart by ten sd in each bin; the last one is in time, and one that is known is as well."""
    rng, n = np.random.default_rng(4), 12
    y, late = rng.normal(size=(n, len(LATE), PATTERN)), rng.integers(len(LATE), size=n)
    late[-1] = 0
    y[np.arange(n), late] += 10.0
    late[3], y[3, 0], y[3, 1:] = 0, 10.0, np.nan
    chosen, placed = aligned(y, np.eye(PATTERN))
    assert np.array_equal(chosen, y[np.arange(n), late])
    each = np.where(np.arange(n) == 3, 1.0, LIKELY[late])[::-1]
    assert placed == pytest.approx(np.append(0.0, np.cumsum(np.log(each[1:]))))


@pytest.mark.parametrize("jolt", [_blow, pytest.param(_rebound, marks=pytest.mark.slow)])
def test_a_jolt_of_a_joints_friction_that_recurs_is_play_of_that_joint(shop: Shop, jolt) -> None:
    j, log = 0, shop.log(seconds=40.0, rate=100.0)
    friction = shop.dynamics.drive.coulomb[j]
    jolts = _jolts(log, log.joint("actual_qd")[:, j], jolt, since=5.0)
    (finding,) = shop.disturbed(log, j, friction * jolts).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", j)
    assert finding.onset_s > log.t[0] + 4.9
    earliest, latest = finding.onset_interval_s
    assert log.t[0] < earliest < log.t[0] + 5.0 < latest  # within a reversal of that


@pytest.mark.parametrize(
    ("share", "told"), [(0.01, False), pytest.param(0.3, True, marks=pytest.mark.slow)]
)
def test_no_model_is_as_fine_as_a_recording_that_was_smoothed(
    shop: Shop, share: float, told: bool
) -> None:
    """It has next to no noise, beside which all that a model is off by would pass for play."""
    j, log, drive = 0, shop.log(seconds=40.0, rate=100.0), shop.fit.dynamics.drive
    current = shop.fit.dynamics.current(shop.motion(log)[0])
    current += 1e-4 * np.random.default_rng(2).standard_normal(current.shape)
    jolts = _jolts(log, log.joint("actual_qd")[:, j], _blow)
    current[:, j] += share * drive.coulomb[j] / drive.gain[j] * jolts
    found = diagnose(shop.fit, with_current(log, current)).findings
    assert [(f.kind, f.joint) for f in found] == [("joint_backlash", j)] * told


@pytest.mark.parametrize("speed", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("acceleration", [0.5, 2.0, 6.0])
def test_friction_that_fades_with_speed_otherwise_is_no_play(speed: float, acceleration: float):
    """Half as much again where the joint turns over leaves little of itself in a window."""
    v = acceleration * BIN * (np.arange(BINS) + 0.5 - BEFORE)
    held = np.sign(v)
    more = 0.5 * held * np.exp(-np.abs(v) / speed)
    known, unknown = _apart(more, held, *faded(held, v)), _apart(more, held)
    assert np.abs(known).max() < 0.1 * np.abs(unknown).max()


def _windows(t: Array, v: Array, held: Array, left: Array) -> Array | None:
    """What is left of a window about 0, where a load turns over; of one joint."""
    given = {f.name: np.zeros((len(t), 1)) for f in fields(Rows)}
    drive = np.zeros((len(t), COULOMB + 1, 1))
    drive[:, COULOMB, 0] = held
    rows = Rows(**{**given, "t": t, "v": v[:, None], "drive": drive})
    return _window(rows, t, left, j=0, t0=0.0, least=0.01)


@pytest.mark.parametrize("turns", [-0.07, -0.04, -0.01, 0.0, 0.03, 0.05, 0.09, 0.11])
def test_another_friction_is_no_play_wherever_in_a_window_a_joint_turns_over(turns: float) -> None:
    """As much again: a tenth of it is left, or less."""
    t = np.arange(-0.3, 0.4, 0.002)
    v = 3.0 * (t - turns)
    y = _windows(t, v, held=np.sign(v), left=np.sign(v))
    assert y is not None
    assert np.abs(y).max() < 0.1


@pytest.mark.parametrize("creep", [-0.005, 0.0, 0.005])
@pytest.mark.parametrize("sets_off", [-0.05, 0.0, 0.05, 0.1])
def test_a_joint_that_creeps_and_sets_off_tells_nothing(creep: float, sets_off: float) -> None:
    t = np.arange(-0.3, 0.4, 0.002)
    v = np.maximum(creep, 3.0 * (t - sets_off))
    assert _windows(t, v, held=np.sign(v), left=np.zeros(len(t))) is None


@pytest.mark.parametrize("many", range(BINS - 1))
def test_a_joint_that_turns_over_slides_on_at_once(many: int) -> None:
    v = np.where(np.arange(BINS) < 1, -0.2, 0.2)
    v[1 : 1 + many] = 0.5 * STANDING
    assert slides(v) == slides(-v) == (many <= BRISK)
    assert slides(np.abs(v)) == (many == 0)  # it dips


def test_a_joint_that_turns_over_twice_does_not_slide() -> None:
    v = np.full(BINS, 0.2)
    assert slides(v)
    v[BEFORE] = -0.2
    assert not slides(v)


@pytest.mark.slow
def test_friction_that_doubles_in_a_real_run_is_no_play(real: Fit, recorded: Recorded) -> None:
    """Also where it turns over more sharply than the model has it, and fades with speed."""
    log, drive = recorded("ur-20_02_05-20sec_12harm"), real.dynamics.drive
    v, after = log.joint("actual_qd"), log.t > log.t[0] + 11.0
    more = drive.coulomb * np.sign(v) * (1.0 + 0.6 * np.exp(-np.abs(v) / 0.1)) / drive.gain
    current = log.joint("actual_current") + after[:, None] * more
    kinds = {f.kind for f in diagnose(real, with_current(log, current)).findings}
    assert "friction_increase" in kinds
    assert "joint_backlash" not in kinds


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 1, 2])
def test_a_jolt_in_a_real_run_is_play_and_no_push(
    real: Fit, recorded: Recorded, joint: int
) -> None:
    log, drive = recorded("ur-20_02_12-40sec_12harm"), real.dynamics.drive
    current = log.joint("actual_current").copy()
    jolts = _jolts(log, log.joint("actual_qd")[:, joint], _rebound)
    current[:, joint] += drive.coulomb[joint] / drive.gain[joint] * jolts
    (finding,) = diagnose(real, with_current(log, current)).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", joint)
    assert finding.evidence["recurs_at"] in ("velocity", "current")


def _swing(after: Array) -> Array:
    return _within(after, 0.0, 0.08) * np.sin(np.pi * after / 0.08)


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, 2, 5])
def test_a_jolt_where_the_controllers_torque_turns_over_is_play(
    real: Fit, recorded: Recorded, joint: int
) -> None:
    """In it is what turns rotors, on a wrist that carries nothing almost all of it."""
    log, drive = recorded("ur-20_02_12-40sec_12harm"), real.dynamics.drive
    current = log.joint("actual_current").copy()
    jolts = _jolts(log, log.joint("target_moment")[:, joint], _swing)
    current[:, joint] += drive.coulomb[joint] / drive.gain[joint] * jolts
    (finding,) = diagnose(real, with_current(log, current)).findings
    assert (finding.kind, finding.joint) == ("joint_backlash", joint)


@pytest.mark.parametrize(("pushes", "told"), [("one", False), ("many", True)])
def test_what_one_push_shakes_recurs_nowhere(shop: Shop, pushes: str, told: bool) -> None:
    """It reverses a joint six times in 1.5 s; as many pushes are play."""
    t, blows = np.arange(0.0, 14.0, 0.008), 10.0 + 0.3 * np.arange(6)
    given = {f.name: np.zeros((len(t), 6)) for f in fields(Rows)}
    given |= {"t": t, "v": np.full((len(t), 6), 0.5), "drive": np.zeros((len(t), ROTOR + 1, 6))}
    turns = np.searchsorted(blows, t) % 2
    given["predicted"][:, 0] = np.where(turns, -1.0, 1.0)
    left = 0.1 * np.random.default_rng(6).standard_normal((len(t), 6))
    left[:, 0] += sum((-1.0) ** k * _rebound(t - at) for k, at in enumerate(blows))
    loud = {
        "one": np.array([[blows[0], blows[-1] + 0.2]]),
        "many": np.column_stack([blows, blows + 0.15]),
    }[pushes]
    rows, still, load = Rows(**given), np.zeros(6, dtype=bool), np.ones((len(t), 6))
    alone = Recurring(space(shop.fit), read_rules().fast.joint_backlash)
    _, found = alone.step(at_first(6), rows, load, left, np.ones(left.shape, bool), loud, still)
    assert [event.joint for event in found] == [0] * told


def test_a_push_is_a_joints_own_only_where_it_has_play_and_turned_over(shop: Shop) -> None:
    log = shop.log("collision:link=4,force=90/0/60,onset=4", seconds=7.0)
    (push,) = diagnose(shop.fit, log).findings
    coulomb = shop.dynamics.drive.coulomb
    most = int(np.argmax(np.abs(push.evidence["torque_Nm"]) / coulomb))
    play = replace(push, kind="joint_backlash", joint=most)
    elsewhere = replace(play, joint=(most + 1) % 6)

    def turned(after: float):
        seen = at_first(6)
        t = seen.t.copy()
        t[:, 0, -1] = push.onset_s - after
        return replace(seen, t=t)

    assert unjolted((push, play), turned(0.05), coulomb) == (play,)
    assert unjolted((push, play), turned(1.0), coulomb) == (push, play)
    assert unjolted((push, elsewhere), turned(0.05), coulomb) == (push, elsewhere)
    assert unjolted((push,), turned(0.05), coulomb) == (push,)
