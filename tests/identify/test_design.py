"""The linear problem is the model: at the point to the last digit, around it to first order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from urdyn.identify import design as room
from urdyn.identify.compress import residuals
from urdyn.identify.design import (
    AROUND,
    SETTLED,
    TERMS,
    blocks,
    coefficients_at,
    design,
    runs,
    standing,
    turning,
)
from urdyn.model.drive import Drive
from urdyn.model.dynamics import Dynamics
from urdyn.model.friction import travel
from urdyn.types import STANDSTILL, Array, Motion

STEP = 1e-5  # of a finite difference in a logarithm


def whole(point: Dynamics, motion: Motion) -> tuple[Array, Array, Array]:
    """Columns of the last joint, current, and what is known, of all blocks end to end."""
    parts = list(blocks(point, motion))
    designs = [design(point, block) for block in parts]
    return (
        np.vstack([d.columns(5) for d in designs]),
        np.vstack([block.motion.current for block in parts]),
        np.vstack([d.known for d in designs]),
    )


def test_columns_times_coefficients_are_the_torque_over_the_gain(
    point: Dynamics, motion: Motion
) -> None:
    (block,) = blocks(point, motion)
    problem = design(point, block)
    predicted = np.column_stack(
        [problem.columns(j) @ w for j, w in enumerate(coefficients_at(point))]
    )
    s = block.bristles.together(point.drive.presliding_tail)
    wanted = point.torque(block.motion, s) / point.drive.gain
    scale = np.abs(wanted).max()
    np.testing.assert_allclose(predicted, wanted, rtol=0, atol=1e-12 * scale)


def test_the_truth_leaves_nothing_of_a_current_without_noise(
    point: Dynamics, motion: Motion
) -> None:
    left = np.concatenate([run for joint in residuals(point, motion) for run in joint])
    assert np.abs(left).max() < 1e-12 * np.abs(motion.current).max()


def test_what_no_motor_draws_was_not_measured(point: Dynamics, motion: Motion) -> None:
    row, joint = len(motion) // 2, 2
    most = point.arm.effort_limit[joint] / point.drive.gain[joint]  # [A] that the joint may draw
    _, _, before = whole(point, motion)
    for current, told in ((most, True), (5.0 * most, False), (np.inf, False)):
        drawn = motion.current.copy()
        drawn[row, joint] = current
        _, _, known = whole(point, replace(motion, current=drawn))
        assert before[row, joint] and known[row, joint] == told
        assert np.count_nonzero(known != before) == (not told)


def logarithm(name: str) -> Callable[[Drive, float], Drive]:
    return lambda drive, h: replace(drive, **{name: getattr(drive, name) * np.exp(h)})


def share(drive: Drive, h: float) -> Drive:
    return replace(drive, presliding_tail=drive.presliding_tail + h)


@pytest.mark.parametrize(
    ("name", "moved"),
    [
        ("presliding_distance", logarithm("presliding_distance")),
        ("presliding_tail", share),
        ("stribeck_velocity", logarithm("stribeck_velocity")),
    ],
)
def test_columns_of_the_shape_are_derivatives_of_torque(
    name: str, moved: Callable[[Drive, float], Drive], point: Dynamics, motion: Motion
) -> None:
    (block,) = blocks(point, motion)
    column = design(point, block).terms[TERMS.index(name)]
    ahead = motion.ahead(point.drive.time_offset)
    up, down = (replace(point, drive=moved(point.drive, h)).torque(ahead) for h in (STEP, -STEP))
    # A central difference is good to STEP² and to rounding of the torque over STEP, which is that
    # of the way over the distance where the presliding state is concerned.
    way = np.abs(travel(ahead)).sum(axis=0) / point.drive.presliding_distance
    rounding = np.finfo(float).eps * np.abs(up).max() * (1.0 + way.max() / len(ahead) ** 0.5)
    tolerance = STEP**2 * np.abs(column).max() + rounding / STEP
    assert np.abs(column).max() > 100.0 * tolerance
    np.testing.assert_allclose(column, (up - down) / (2 * STEP), rtol=0, atol=10 * tolerance)


def test_the_column_of_time_is_its_derivative_while_friction_turns_when_it_does(
    point: Dynamics, motion: Motion
) -> None:
    (block,) = blocks(point, motion)
    column = design(point, block).terms[TERMS.index("time_offset")]
    slides = (np.abs(block.bristles.state) > 1.0 - 1e-9).all(axis=0)

    def later(h: float) -> Array:
        times = {"time_offset": point.drive.time_offset + h}
        times["friction_lead"] = point.drive.friction_lead - h
        moved = replace(point, drive=replace(point.drive, **times))
        return moved.torque(motion.ahead(moved.drive.time_offset))

    h = 1e-4
    before, now, after = map(later, (-h, 0.0, h))
    central = (after - before) / (2.0 * h)
    # Where joints slide. The slopes to either side are as far from that between, also at a kink.
    error = np.abs(after - 2.0 * now + before) / (2.0 * h) + 1e-5 * np.abs(column).max()
    assert (np.abs(column - central) <= 2.0 * error)[slides].all() and slides.mean() > 0.5
    assert np.median(error[slides]) < 1e-3 * np.std(column)


def test_it_does_not_matter_where_blocks_end(
    point: Dynamics, motion: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = whole(point, motion)
    monkeypatch.setattr(room, "BLOCK", 97)
    assert len(list(blocks(point, motion))) == 13
    way = np.abs(travel(motion)).sum() / point.drive.presliding_distance.min()
    for part, wanted in zip(whole(point, motion), one, strict=True):
        bound = 4.0 * np.finfo(float).eps * way * max(1.0, float(np.abs(wanted).max()))
        np.testing.assert_allclose(part, wanted, rtol=0, atol=bound)


def test_nothing_is_known_until_a_joint_has_come_some_way(point: Dynamics, motion: Motion) -> None:
    (block,) = blocks(point, motion)
    distance = point.drive.presliding_distance
    way = np.abs(np.diff(motion.q, axis=0, prepend=motion.q[:1])).cumsum(axis=0)
    stands = standing(motion.ahead(point.drive.time_offset))
    assert not block.known[0].any() and block.known[len(motion) // 2].all()
    assert not block.known[way < 0.9 * SETTLED * distance].any()
    assert (block.known | stands)[way > 1.1 * SETTLED * distance].all()


def test_after_a_gap_the_joints_have_to_settle_again(point: Dynamics, motion: Motion) -> None:
    cut = 600
    late = motion.t + 3.0 * (np.arange(len(motion)) >= cut)
    first, second = blocks(point, replace(motion, t=late, breaks=(cut,)))
    assert len(first.motion) == cut and not second.known[0].any()
    again = next(blocks(point, motion.slice(cut)))
    np.testing.assert_array_equal(second.known, again.known)
    # Later stamps are coarser: 2e-15 of 0.01 s, times a travel of some tens of distances.
    state, alone = second.bristles.state, again.bristles.state
    np.testing.assert_allclose(state, alone, rtol=0, atol=1e-11)


def test_where_nobody_measured_nothing_is_known(point: Dynamics, motion: Motion) -> None:
    current, q = motion.current.copy(), motion.q.copy()
    current[700:710, 2] = np.nan
    q[800, 4] = np.nan
    (full,), (holed,) = (blocks(point, m) for m in (motion, replace(motion, current=current, q=q)))
    wanted = full.known.copy()
    wanted[700:710, 2] = False
    wanted[800] = False  # the torque of every joint hangs on every angle
    np.testing.assert_array_equal(holed.known, wanted)


def test_runs_are_the_known_rows_and_no_others() -> None:
    known = np.random.default_rng(0).random(200) < 0.7
    found = list(runs(known))
    assert np.array_equal(
        np.concatenate([np.arange(200)[run] for run in found]), known.nonzero()[0]
    )
    assert all(not known[run.stop] for run in found if run.stop < 200)


def test_a_joint_turns_round_where_its_velocity_changes_sign() -> None:
    t = 0.002 * np.arange(2000)
    v = np.tile(np.sin(2.0 * np.pi * (t + 0.2345))[:, None], 6)  # zeros 0.2655 + k / 2
    v[:, 1], v[:, 2] = 1.0, 0.0
    still = np.zeros_like(v)
    swung = Motion(t, still, v, still, still, still, still)
    zeros = 0.2655 + 0.5 * np.arange(8)
    near = (np.abs(t[:, None] - zeros) <= AROUND).any(axis=1)
    found = turning(swung, standing(swung))
    assert np.count_nonzero(found[:, 0] != near) <= len(zeros)  # at the first row behind it
    assert not found[:, 1].any() and found[:, 2].all()


def test_a_joint_that_reverses_is_compared_and_one_that_stands_is_not(point: Dynamics) -> None:
    """A rest is rounded to no exact zero. Joint 0 has rests, joint 1 reversals only."""
    t = 0.008 * np.arange(1000)
    v = np.tile(np.sin(2.0 * np.pi * (t + 0.2345))[:, None], 6)
    stopped = (np.abs(t[:, None] - [3.0, 5.0]) < 0.4).any(axis=1)
    v[stopped, 0] = -1e-16
    q = 0.008 * np.cumsum(v, axis=0)
    none = np.zeros_like(v)
    (block,) = blocks(point, Motion(t, q, v, none, none, none, none))
    rests = np.column_stack([stopped, np.zeros((1000, 5), dtype=bool)])
    settled = slice(200, None)
    # To either side of a rest, a sine is slow for two more rows at the most.
    fewer = block.known[settled] != ~rests[settled]
    assert not (block.known & rests).any() and block.turning[stopped, 0].all()
    assert not fewer[:, 1:].any() and np.count_nonzero(fewer) <= 4
    assert (np.abs(v[settled, 1]) < STANDSTILL).any()


def test_a_joint_that_creeps_slides(point: Dynamics) -> None:
    """In two minutes at a slow tool's speed it goes more than a radian."""
    t, creep = 0.02 * np.arange(6000), np.full((6000, 6), 0.01)
    none = np.zeros_like(creep)
    (block,) = blocks(point, Motion(t, t[:, None] * creep, creep, none, none, none, none))
    assert block.known[2000:].all()
