"""A load that was taken for one too early is weighed again before it is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.kinds.change import Change
from urdyn.diagnose.load import carried
from urdyn.diagnose.load.carried import Mode
from urdyn.diagnose.load.carrying import Carrying
from urdyn.diagnose.load.lasting_load import LastingLoad
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.onsets import Block
from urdyn.diagnose.slow.slow import BLOCK, Slow
from urdyn.diagnose.slow.slow_state import SlowState

USUAL, LADEN = 4, 4  # blocks with what is carried as a rule, and with another load
SINCE = USUAL * BLOCK  # [s]
NOW = SINCE + LADEN * BLOCK  # [s]
LOAD = Mode(np.array([1.0, *[0.0] * 9]), np.diag(carried.NOTHING**2), NOW)  # 1 kg
ELBOW = 2


def carrying_it(slow: Slow, changes: dict[int, float]) -> SlowState:
    """Blocks of an arm that is said to carry a load; without it these states have changed.

    Args:
        changes: by state, how far, each ten times its sd in a block.
    """

    def block(k: int, which: dict[int, float]) -> Block:
        A, b = np.zeros((slow.healthy.size,) * 2), np.zeros(slow.healthy.size)
        for at, size in changes.items():
            A[at, at] = (10.0 / size) ** 2
            b[at] = A[at, at] * which.get(at, 0.0)
        return Block(k * BLOCK, (k + 1) * BLOCK, A, b)

    usual = [block(k, {}) for k in range(USUAL)]
    laden = [
        replace(block(k, {}), A=np.zeros((slow.healthy.size,) * 2), unladen=block(k, changes))
        for k in range(USUAL, USUAL + LADEN)
    ]
    state = slow.init()
    modes = carried.commissioned(), LOAD
    carrying = Carrying(modes, now=1, was=1, away=(0.0, NOW - SINCE), since=SINCE)
    state = replace(state, carrying=carrying)
    return replace(state, recall=replace(state.recall, blocks=(*usual, *laden)))


def settled(
    slow: Slow,
    state: SlowState,
    monkeypatch: pytest.MonkeyPatch,
    ended: bool = False,
    since: float = SINCE,
) -> SlowState:
    """Once that load has been carried for long enough, as it seems since `since` [s]."""
    tool = next(k for k, each in enumerate(slow.of.each) if each.kind.of_tool)
    span = (since, since)
    change = Change(tool, since, span, span, NOW, 1.0, np.nan, 1.0, 0.1, 0.0, 0.0)
    monkeypatch.setattr(LastingLoad, "settled", lambda self, carrying, *of: (carrying.here, change))
    return slow._settled(state, NOW, ended)


@pytest.fixture
def slow(shop: Shop) -> Slow:
    return shop.diagnosis(shop.log(seconds=2.0)).slow


def test_a_load_that_explains_more_than_a_joint_is_told_beside_its_rivals(
    slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = settled(slow, carrying_it(slow, {slow.space.payload[0]: 1.0}), monkeypatch)
    (change,) = state.found
    assert change.confidence > 0.99
    assert len(change.rivals) == 2
    assert all(not slow.of.each[k].kind.of_tool for k, _ in change.rivals)
    assert change.confidence + sum(share for _, share in change.rivals) <= 1.0


@pytest.mark.parametrize("ended", [False, True])
def test_a_joint_that_explains_more_than_a_load_takes_back_what_that_took(
    slow: Slow, monkeypatch: pytest.MonkeyPatch, ended: bool
) -> None:
    z = slow.space.places["z"].start + ELBOW
    state = settled(slow, carrying_it(slow, {z: -0.2}), monkeypatch, ended)
    assert not any(slow.of.each[change.suspect].kind.of_tool for change in state.found)
    assert len(state.carrying.modes) == 1
    assert not state.carrying.away
    named = state.found[0].suspect if ended else state.likely
    assert named is not None
    assert slow.of.each[named].kind.name == "health_degradation"
    assert slow.of.each[named].joint == ELBOW


def test_between_both_one_waits_and_a_load_that_took_no_whole_block_is_told(
    slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = carrying_it(slow, {slow.space.payload[0]: 1.0})
    even = tuple(0.5 for _ in slow.of.each)
    monkeypatch.setattr(type(slow.judge), "shares", lambda *of: even)
    assert settled(slow, state, monkeypatch) is state
    assert settled(slow, state, monkeypatch, ended=True).found
    monkeypatch.undo()
    none = replace(state, recall=replace(state.recall, blocks=state.recall.blocks[:USUAL]))
    (change,) = settled(slow, none, monkeypatch).found
    assert change.confidence == 1.0
    assert not change.rivals


@pytest.mark.parametrize(("alarm", "began"), [(NOW, SINCE - BLOCK), (SINCE + 2.0 * BLOCK, None)])
def test_a_load_that_a_joints_fault_hid_may_have_come_since_the_usual_one_was_last_seen(
    slow: Slow, monkeypatch: pytest.MonkeyPatch, alarm: float, began: float | None
) -> None:
    """A sensor that begins to read too low makes it look put down, until that is known."""
    state, since = carrying_it(slow, {slow.space.payload[0]: 1.0}), SINCE + 3.0 * BLOCK
    elbow = next(k for k, s in enumerate(slow.of.each) if s.joint == ELBOW and s.kind.of_sensor)
    fault = Fault(elbow, since - 1.5 * BLOCK, since - BLOCK, alarm, -0.3)
    state = settled(slow, replace(state, known=(fault,)), monkeypatch, since=since)
    (change,) = state.found
    assert change.began == (since if began is None else began, since)
    assert change.onset == (since if began is None else SINCE)


def test_a_load_that_has_become_the_usual_one_was_so_in_all_blocks_that_bore_it(
    slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a later fault hides has come since the last of them, not since before the first."""
    state = settled(slow, carrying_it(slow, {slow.space.payload[0]: 1.0}), monkeypatch)
    elbow = next(k for k, s in enumerate(slow.of.each) if s.joint == ELBOW and s.kind.of_sensor)
    fault = Fault(elbow, SINCE + 1.5 * BLOCK, SINCE + 2.0 * BLOCK, NOW, -0.3)
    state = replace(state, known=(fault,), found=())
    (change,) = settled(slow, state, monkeypatch, since=SINCE + 3.0 * BLOCK).found
    assert change.began == (SINCE + BLOCK, SINCE + 3.0 * BLOCK)
    assert change.onset == SINCE + 3.0 * BLOCK
