"""What is proven holds, by a witness that shares nothing with the proof; the rest is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from witness import RATE, watch

from urdyn.errors import InputError, UnsafeMotionError
from urdyn.identify.excite import Safe, excite, prove
from urdyn.identify.excite.proof import DISTANCE, SHARE
from urdyn.identify.excite.restart import fitted
from urdyn.model.arm import load_arm, read_arm
from urdyn.model.cell import Cell, Solid, floor
from urdyn.model.collision import collider
from urdyn.model.torque_rate import torque_rate
from urdyn.simulate.fourier import draw
from urdyn.simulate.limits import comfortable
from urdyn.simulate.moves import Move, Moves

MARGIN = 0.02


def safe(arm, cell=None):
    return Safe(comfortable(arm), collider(arm, cell or Cell((floor(),)), MARGIN), MARGIN)


def random_series(arm, seed, period=8.0):
    shape = draw(arm.joints, period, np.random.default_rng(seed), 5)
    limits = comfortable(arm)
    return fitted(replace(shape, middle=limits.middle).scaled(10.0), limits)


def test_what_was_found_is_seen_to_be_safe(found):
    seen = watch(found.arm, found.path, found.ask.limits, found.path.lasting)
    assert seen.moments > 0.99 * RATE * found.path.lasting
    assert seen.none, seen


@pytest.mark.parametrize("robot", ["ur3", pytest.param("ur20", marks=pytest.mark.slow)])
def test_the_witness_sees_nothing_where_the_proof_holds_and_something_where_it_fails(robot):
    arm = load_arm(robot)
    verdicts = {True: 0, False: 0}
    for seed in range(6):
        path, asked = random_series(arm, seed), safe(arm)
        try:
            prove(arm, path, asked)
        except UnsafeMotionError:
            verdicts[False] += 1
        else:
            verdicts[True] += 1
            assert watch(arm, path, asked.limits, path.lasting).none
    assert verdicts[True], "no motion to look at"


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["ur3e", "ur5", "ur5e", "ur10", "ur10e", "ur16e", "ur30"])
def test_no_proven_motion_of_any_arm_is_seen_to_touch_anything(robot):
    arm = load_arm(robot)
    proven = 0
    for seed in range(100, 110):
        path, asked = random_series(arm, seed), safe(arm)
        try:
            prove(arm, path, asked)
        except UnsafeMotionError:
            continue
        proven += 1
        assert watch(arm, path, asked.limits, path.lasting).none
    assert proven


def test_a_thing_between_two_rows_is_found(ur10e):
    """A move that passes a post at full speed, free wherever a coarse look would fall."""
    reach = np.array([0.0, -np.pi / 2, 1.4, -np.pi / 2, -1.4, 0.0])
    swing = np.array([1.4, 0.0, 0.0, 0.0, 0.0, 0.0])
    move = Moves((Move(0.0, 2.8, reach - swing, reach + swing),), 2.8)
    prove(ur10e, move, safe(ur10e))
    tool = ur10e.pose(reach)[:3, 3]
    post = Solid("post", "cylinder", np.array([0.004, 0.6]), xyz=tool)
    with pytest.raises(UnsafeMotionError, match="post") as short:
        prove(ur10e, move, safe(ur10e, Cell(solids=(post,))))
    assert short.value.kind == "distance"
    assert 1.0 < short.value.when < 1.8


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"velocity": 0.5}, "velocity"),
        ({"acceleration": 0.9}, "acceleration"),
        ({"torque": 0.3}, "torque"),
        ({"upper": 0.5, "lower": 0.5}, "angle"),
    ],
)
def test_every_limit_is_watched(ur10e, change, word):
    path, asked = random_series(ur10e, 0), safe(ur10e)
    prove(ur10e, path, asked)
    tighter = {name: share * getattr(asked.limits, name) for name, share in change.items()}
    with pytest.raises(UnsafeMotionError, match=rf"% of its {word} limit at \d+\.\d+ s") as short:
        prove(ur10e, path, replace(asked, limits=replace(asked.limits, **tighter)))
    assert short.value.kind == word


@pytest.mark.parametrize("robot", ["ur3e", "ur10e", "ur30"])
def test_torque_never_changes_faster_than_its_bound(robot):
    arm, h = load_arm(robot), 1e-4
    path = random_series(arm, 1)
    t = np.random.default_rng(0).uniform(0.0, path.lasting, 400)
    (q, v, a), (q1, v1, a1) = path.at(t), path.at(t + h)
    bound = torque_rate(arm, np.abs(v) + 0.01, np.abs(a) + 0.01, np.abs(a1 - a) / h + 1.0)
    change = np.abs(arm.torque(q1, v1, a1) - arm.torque(q, v, a)) / h
    assert (change <= bound).all()
    # And a joint that holds its arm up is not bounded a thousand times too widely.
    assert (bound[:, 1] < 200.0 * change[:, 1].max()).all()


def test_shares_and_clearance_hold_at_any_moment(found):
    limits, proof = found.ask.limits, found.proof
    t = np.random.default_rng(0).uniform(0.0, found.path.lasting, 3000)
    q, v, a = found.path.at(t)
    for kind, share in limits.shares(found.arm, q, v, a).items():
        assert share.max() <= proof.shares[kind] + 1e-9, kind
    near = collider(found.arm, found.ask.cell, found.ask.margin).distances(q)
    assert near.min() >= proof.clearance - 1e-5  # of coal's iterations
    assert proof.clearance >= found.ask.margin


def test_what_is_proven_is_hardly_more_than_what_the_motion_takes():
    arm = load_arm("ur10e")
    path, asked = random_series(arm, 1), safe(arm)
    proof = prove(arm, path, asked)
    q, v, a = path.at(np.linspace(0.0, path.lasting, 4001))
    still = np.zeros_like(q)
    taken = [asked.limits.shares(arm, q, *how) for how in ((v, a), (still, still))]
    for kind, share in proof.shares.items():
        assert share <= max(of[kind].max() for of in taken) + SHARE, kind
    near = asked.collider.distances(q).min(axis=0)
    assert proof.clearance >= near.min() - DISTANCE - 1e-5  # of coal's iterations
    assert proof.closest == asked.collider.pairs[int(near.argmin())]


def test_slower_motion_needs_no_more_torque(found):
    """What lets the script begin at 10 %."""
    q, v, a = found.path.at(np.linspace(0.0, found.path.lasting, 500))
    for speed in (0.0, 0.1, 0.5, 1.0):
        torque = np.abs(found.arm.torque(q, speed * v, speed**2 * a))
        assert (torque <= found.ask.limits.torque).all()


def test_a_box_in_the_way_is_named(ur10e, found):
    where = ur10e.pose(found.path.at(np.array([1.0]))[0][0])[:3, 3]
    box = Solid("fixture", "box", np.full(3, 0.05), xyz=where)
    with pytest.raises(UnsafeMotionError, match="fixture") as short:
        prove(ur10e, found.path, safe(ur10e, Cell((floor(),), (box,))))
    assert short.value.kind == "distance"
    assert isinstance(short.value, InputError)


@pytest.mark.parametrize("limit", ["velocity", "effort"])
def test_nothing_is_proven_of_an_arm_that_tells_no_limit(ur10e, limit):
    unrated = read_arm(re.sub(f'{limit}="[^"]*"', f'{limit}="0"', ur10e.urdf))
    with pytest.raises(InputError, match="shoulder_pan_joint lacks a limit of velocity or effort"):
        excite(unrated)


def test_a_velocity_limit_that_is_none_is_doubted_as_much_as_the_effort(ur10e):
    """An exporter's placeholder: at such a speed friction takes more than any motor gives."""
    placeholder = read_arm(re.sub('velocity="[^"]*"', 'velocity="1000"', ur10e.urdf))
    with pytest.raises(
        InputError, match=r"at 900 rad/s, .* limits of effort and velocity right\?$"
    ):
        excite(placeholder)


def test_a_motion_on_its_limit_is_not_proven_for_ever(ur10e):
    """Where nothing is left, halving ends, and soon."""
    path = random_series(ur10e, 0)
    asked = safe(ur10e)
    least = np.abs(path.at(np.linspace(0.0, 8.0, 100_001))[2]).max(axis=0)
    touching = replace(asked.limits, acceleration=least)
    with pytest.raises(UnsafeMotionError, match=r"between two moments|acceleration limit"):
        prove(ur10e, path, replace(asked, limits=touching))
