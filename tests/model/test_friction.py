"""Laws of presliding friction: what bristles do does not hang on who watches, or how often."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from urdyn.model.arm import Arm
from urdyn.model.drive import LINEAR
from urdyn.model.friction import Contact, bristles, feature, features, hysteresis, travel
from urdyn.model.population import population
from urdyn.types import Array, Motion

DISTANCE = 2e-4  # [rad]


def rounding(moved: Array) -> float:
    """Of the state: that of the whole way over the distance, from which each leg is told apart."""
    return float(4.0 * np.finfo(float).eps * np.abs(moved).sum() / DISTANCE)


def wandering(rng: np.random.Generator, rows: int = 400) -> Array:
    """Travel from row to row with reversals, from a hundredth to tens of distances, (rows,)."""
    return DISTANCE * rng.standard_normal(rows) * 10.0 ** rng.uniform(-2.0, 1.0, rows)


def swinging(rows: int = 500, breaks: tuple[int, ...] = ()) -> Motion:
    """Six joints that swing and reverse, (rows, 6)."""
    t = np.arange(rows) / 100.0
    t[list(breaks)] += 1.0  # the stamp tells nothing there: travel has to know of the gap
    w = np.array([1.0, 1.7, 2.3, 3.1, 4.3, 5.9])
    q, v = np.sin(np.outer(t, w)), w * np.cos(np.outer(t, w))
    unmeasured = np.full_like(q, np.nan)
    return Motion(t, q, v, -(w**2) * q, -(w**2) * v, unmeasured, unmeasured, breaks)


@pytest.mark.parametrize("seed", range(5))
def test_the_state_does_not_depend_on_the_sampling(seed: int) -> None:
    rng = np.random.default_rng(seed)
    coarse, start = wandering(rng), np.array([0.3, -0.1])
    shares = rng.dirichlet(np.ones(7), len(coarse))  # every stretch in seven monotone pieces
    fine = (coarse[:, None] * shares).ravel()
    whole, pieces = hysteresis(coarse, DISTANCE, start), hysteresis(fine, DISTANCE, start)
    # A contraction forgets its rounding errors: a few ulp of 1 are left.
    np.testing.assert_allclose(np.array(pieces)[:, 6::7], whole, rtol=0, atol=rounding(fine))


@pytest.mark.parametrize("start", [-1.0, 0.0, 1.0])
def test_friction_never_exceeds_that_of_sliding(start: float) -> None:
    state, _ = hysteresis(wandering(np.random.default_rng(3)), DISTANCE, np.array([start, 0.0]))
    assert np.abs(state).max() <= 1.0  # rounding is monotone, and 1 is a float


def test_long_travel_slides_and_standing_still_keeps_the_state() -> None:
    state, slope = hysteresis(DISTANCE * np.array([50.0, 0.0, -50.0, 0.0]), DISTANCE, np.zeros(2))
    np.testing.assert_allclose(state, [1.0, 1.0, -1.0, -1.0], rtol=0, atol=2.0 * np.exp(-50.0))
    assert slope[0] == slope[1] and slope[2] == slope[3]


def test_the_slope_is_the_derivative_in_the_log_of_distance() -> None:
    moved, h = wandering(np.random.default_rng(4)), 1e-5
    _, slope = hysteresis(moved, DISTANCE, np.zeros(2))
    up, down = (hysteresis(moved, DISTANCE * np.exp(x), np.zeros(2))[0] for x in (h, -h))
    # A central difference is good to h², 1e-10, and to rounding / h.
    bound = 1e-9 + rounding(moved) / h
    np.testing.assert_allclose(slope, (up - down) / (2.0 * h), rtol=0, atol=bound)


@pytest.mark.parametrize("seed", range(5))
def test_bristles_give_back_no_more_than_they_hold(seed: int) -> None:
    """Work that went in is at least what is stored: d (|s| - ln(1 + |s|)), which is never negative.

    Of ds/dq = (1 - s w)/d, w = sign(dq), the work of a stretch is ∫ s dq = |dq| - d w Δs.
    """
    moved = wandering(np.random.default_rng(seed))
    closed = np.append(moved, -moved.sum())  # and back to where it began
    s, _ = hysteresis(closed, DISTANCE, np.zeros(2))
    work = np.cumsum(np.abs(closed) - DISTANCE * np.sign(closed) * np.diff(s, prepend=0.0))
    stored = DISTANCE * (np.abs(s) - np.log1p(np.abs(s)))
    rounding = len(s) * np.finfo(float).eps * np.abs(closed).sum()
    assert (work >= stored - rounding).all() and work[-1] > 0.0


@pytest.mark.parametrize("cuts", [(250,), (1, 2, 100, 499)])
def test_bristles_followed_block_by_block_are_those_of_one_pass(cuts: tuple[int, ...]) -> None:
    motion, distance = swinging(), np.full(6, DISTANCE)
    whole = bristles(motion, distance)
    start, states, slopes = None, [], []
    for first, stop in zip((0, *cuts), (*cuts, len(motion)), strict=True):
        lead = min(first, 1)  # the row before tells the travel into the first
        part = bristles(motion.slice(first - lead, stop), distance, start)
        start = part.end
        states.append(part.since(lead).state)
        slopes.append(part.since(lead).slope)
    bound = rounding(travel(motion))
    np.testing.assert_allclose(np.concatenate(states, axis=1), whole.state, rtol=0, atol=bound)
    np.testing.assert_allclose(np.concatenate(slopes, axis=1), whole.slope, rtol=0, atol=bound)


def test_travel_is_the_way_between_rows() -> None:
    motion = swinging()
    way = np.diff(motion.q, axis=0, prepend=motion.q[:1])
    # The trapezoidal rule errs by h³/12 of the velocity's second derivative, w³, a row.
    bound = 0.01**3 / 12.0 * 5.9**3
    np.testing.assert_allclose(travel(motion), way, rtol=0, atol=bound)


def test_nobody_knows_how_far_a_joint_went_in_a_gap() -> None:
    moved = travel(swinging(breaks=(200,)))
    assert (moved[200] == 0.0).all() and (moved[199] != 0.0).all()


def test_bristles_after_a_gap_are_those_of_a_motion_that_begins_there() -> None:
    motion, distance = swinging(breaks=(150, 400)), np.full(6, DISTANCE)
    whole = bristles(motion, distance, lead=0.01)
    parts = [motion.slice(*rows) for rows in ((0, 150), (150, 400), (400, 500))]
    alone = [bristles(part, distance, lead=0.01) for part in parts]
    for name, time in (("state", 1), ("slope", 1), ("travelled", 0)):
        pieces = np.concatenate([getattr(part, name) for part in alone], axis=time)
        np.testing.assert_array_equal(getattr(whole, name), pieces)


def test_bristles_turn_over_before_the_joint_by_their_lead() -> None:
    motion, lead = swinging(), 0.03
    s = np.sign(bristles(motion, np.full(6, 1e-9), lead=lead).state[0])[10:]
    v, ahead = np.sign(motion.v)[10:], np.sign(motion.v + lead * motion.a)[10:]
    turns = np.count_nonzero(np.diff(ahead, axis=0), axis=0)
    assert (np.count_nonzero(s != ahead, axis=0) <= turns).all()  # a row, where it turns in it
    assert (np.count_nonzero(s != v, axis=0) > turns).all()  # three


def test_soft_bristles_carry_their_share() -> None:
    follow, tail = bristles(swinging(), np.full(6, DISTANCE)), np.array([0, 0.2, 0.4, 0.6, 0.8, 1])
    s = follow.together(tail)
    np.testing.assert_array_equal(s[:, 0], follow.state[0, :, 0])
    np.testing.assert_array_equal(s[:, 5], follow.state[1, :, 5])
    assert (s >= follow.state.min(axis=0)).all() and (s <= follow.state.max(axis=0)).all()


def test_there_is_a_feature_for_every_term_of_friction(ur5e: Arm) -> None:
    motion, drive = swinging(), population(ur5e).typical().drive
    one = np.ones_like(motion.q)
    terms = features(Contact(motion.q, motion.v, motion.temperature, one, one), drive)
    assert set(LINEAR) == {"rotor_inertia", *terms}
    assert {values.shape for values in terms.values()} == {motion.q.shape}


def test_a_joint_whose_temperature_nobody_measured_is_as_warm_as_on_the_first_day(
    ur5e: Arm,
) -> None:
    motion, drive = swinging(), population(ur5e).typical().drive
    one = np.ones_like(motion.q)
    unmeasured = Contact(motion.q, motion.v, motion.temperature, one, one)
    assert (feature("thermal", unmeasured, drive) == 0.0).all()
    warm = replace(unmeasured, temperature=one * drive.temperature + 5.0)
    np.testing.assert_allclose(feature("thermal", warm, drive), 5.0 * motion.v)
