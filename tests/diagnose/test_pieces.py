"""A piece too light for a moment to tell is told by its coming and going."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.fast.pushed_link import _left_with_it
from urdyn.diagnose.load import carried
from urdyn.diagnose.load.carried import Mode, Shown, commissioned
from urdyn.diagnose.load.carrying import Carrying
from urdyn.diagnose.load.pieces import LENGTHS, _chain, at_most, unseen

MOMENTS, RUN = 120, 8


def moments(rng: np.random.Generator, piece: np.ndarray, held: np.ndarray) -> list[Shown]:
    """What moments say of a load, each about as much of it as there is."""
    told = []
    for now in held:
        H = rng.standard_normal((6, 10)) * np.array([3.0, 20.0, 20.0, 20.0, *[50.0] * 6])
        y = H @ (piece * now) + rng.standard_normal(6)
        told.append(Shown(H.T @ H, H.T @ y))
    return told


@pytest.mark.parametrize("length", LENGTHS)
def test_the_chain_is_the_sum_over_all_paths(length: float) -> None:
    fits, p = 3.0 * np.random.default_rng(0).standard_normal(6), 1.0 / length
    total, held = 0.0, np.zeros(6)
    for path in product((0, 1), repeat=6):
        moved = [p if a != b else 1.0 - p for a, b in pairwise(path)]
        weight = 0.5 * np.prod(moved) * np.exp(np.dot(path, fits))
        total, held = total + weight, held + weight * np.array(path)
    told, evidence = _chain(fits, length)
    np.testing.assert_allclose(evidence, np.log(total))
    np.testing.assert_allclose(told, held / total)


def test_a_light_piece_is_told_and_what_stays_or_is_not_there_is_none() -> None:
    rng = np.random.default_rng(1)
    piece = np.array([0.5, 0.0, 0.0, 0.04, *[0.0] * 6])
    comes_and_goes = (np.arange(MOMENTS) // RUN) % 2
    mode, gain = unseen(moments(rng, piece, comes_and_goes), commissioned(), 60.0)
    assert gain > 20.0
    assert abs(mode.mean[0] - 0.5) < 4.0 * np.sqrt(mode.cov[0, 0])
    came = np.append(0.0, np.ones(MOMENTS - 1))  # within the first moment
    for held in (np.zeros(MOMENTS), np.ones(MOMENTS), came):
        assert unseen(moments(rng, piece, held), commissioned(), 60.0)[1] < 0.0


def test_a_load_that_an_arm_goes_away_with_is_no_push() -> None:
    sd = np.full((12, 6), 2.0)
    sd[6:] = 20.0  # what held the joints that begin to move is unknown
    stood, load = np.arange(12) < 6, np.array([0.0, 28.0, 10.0, 1.0, 0.0, 0.0])
    stays = np.tile(load, (12, 1))
    goes = stays * (np.arange(12) < 5)[:, None]
    assert _left_with_it(stood, stays, sd)
    assert not _left_with_it(stood, goes, sd)
    assert not _left_with_it(np.ones(12, dtype=bool), stays, sd)
    assert not _left_with_it(~stood, stays, sd)  # it came to rest with it


def test_moments_in_a_row_tell_a_piece_by_their_likelihood() -> None:
    rng, exact, run = np.random.default_rng(6), np.zeros((10, 10)), 5
    first, piece = (Mode(rng.standard_normal(10), exact, 0.0) for _ in range(2))
    roots = rng.standard_normal((20, 10, 10))
    told = [Shown(root @ root.T, rng.standard_normal(10)) for root in roots]
    better = [carried.fit(each, piece) - carried.fit(each, first) for each in told]
    runs = [better[k : k + n] for n in range(1, run + 1) for k in range(len(told) - n + 1)]
    assert at_most(piece, told, first, run) == pytest.approx(max(map(sum, runs)))


def test_one_clear_moment_among_others_that_deny_it_is_as_clear() -> None:
    """A single moment that is off by itself, an encoder's jump say, is no light piece."""
    first, piece = commissioned(), Mode(np.eye(10)[0], np.zeros((10, 10)), 0.0)
    C, d = np.diag(np.eye(10)[0]), 50.0 * np.eye(10)[0]
    told = [Shown(C, sign * d) for sign in (-1.0, -1.0, 1.0, -1.0, -1.0)]
    assert at_most(piece, told, first, 5) == pytest.approx(50.0 - 0.5)


def test_a_piece_need_not_explain_more_than_a_fault_does(shop: Shop) -> None:
    loads = shop.diagnosis(shop.log(seconds=2.0)).slow.loads
    piece = np.array([0.25, 0.0, 0.0, 0.02, *[0.0] * 6])
    comes_and_goes = (np.arange(MOMENTS) // 5) % 2
    told = tuple(moments(np.random.default_rng(4), piece, comes_and_goes))
    carrying = Carrying((commissioned(),), unclaimed=told)
    _, gain = unseen(told, commissioned(), 60.0)
    assert gain > carried.SURE
    assert loads.noticed(carrying, 60.0, gain + 1.0) is None
    noticed = loads.noticed(carrying, 60.0, gain - 1.0)
    assert noticed is not None
    assert abs(noticed.modes[1].mean[0] - piece[0]) < 3.0 * np.sqrt(noticed.modes[1].cov[0, 0])
