"""A change that grows has a forecast, however slowly it does; what only wanders has none."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom
from shop import Shop

from urdyn.diagnose.findings.ledger import RECENT, SERIES, thinned
from urdyn.diagnose.findings.linear_trend import linear_trend
from urdyn.diagnose.findings.prognosis import WALKED, Course, trend
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.onsets import Block

BLOCK = 5.0  # [s]
BEFORE, NOISE, ALIKE = (
    0.03,
    0.012,
    0.43,
)  # sd of what all sizes share, of each, and neighbours' share
WALK = 0.005 / 60.0  # [1/√s] of Coulomb friction, by the rules
DRAWS = 80


def sizes(rate: float, blocks: int, rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """A change as a bank tells it block by block: its sd is mostly that of what was before."""
    z, walk = rng.standard_normal((2, blocks))
    z[1:] *= np.sqrt(1.0 - ALIKE**2)
    noise = lfilter([1.0], [1.0, -ALIKE], z)
    t = BLOCK * (np.arange(blocks) + 0.5)
    strayed = WALK * np.sqrt(BLOCK) * np.cumsum(walk)
    y = rate * t + 0.1 + BEFORE * rng.standard_normal() + NOISE * noise + strayed
    return [(*row, float(np.hypot(BEFORE, NOISE))) for row in zip(t, y, strict=True)]


@pytest.mark.parametrize(("hourly", "blocks"), [(2.5, 40), (0.3, 240), (0.1, 360), (0.05, 720)])
def test_wear_has_a_forecast_that_holds_the_truth_however_slow_it_is(
    hourly: float, blocks: int
) -> None:
    rng, rate, held = np.random.default_rng(5), hourly / 3600.0, []
    left = (0.5 - 0.1) / rate - BLOCK * blocks
    for _ in range(DRAWS):
        course = trend(sizes(rate, blocks, rng), 0.0, BLOCK * blocks, WALK)
        assert course is not None
        if course.grows:
            told = course.until(0.5)
            held.append(told["lo"] <= left <= told["hi"])
    assert len(held) > 0.9 * DRAWS
    assert sum(held) >= binom.ppf(1e-3, len(held), 0.9)


@pytest.mark.parametrize("blocks", [12, 720])
def test_a_rate_is_no_surer_than_how_far_a_size_strays_by_itself(blocks: int) -> None:
    """However exact each size is: of a walk over T, a line's slope has sd walk √(6/5 / T)."""
    rows = [(BLOCK * k, 0.1 + 1e-9 * k, 1e-9) for k in range(blocks)]
    course = trend(rows, -1.0, BLOCK * blocks, WALK)
    lasted = BLOCK * (blocks - 1)
    assert course is not None and course.rate_sd >= 0.99 * WALK * np.sqrt(1.2 / lasted)


def test_what_all_sizes_share_is_not_averaged_away() -> None:
    """Each is compared with the same healthy arm, and its error is in all of them."""
    rows = [(BLOCK * k, 0.1 + 1e-3 * k, BEFORE) for k in range(200)]
    course = trend(rows, -1.0, 1000.0)
    assert course is not None and course.size == pytest.approx(0.3, abs=0.005)
    assert course.size_sd >= BEFORE


@pytest.mark.parametrize("blocks", [12, 60, 240, 720])
def test_what_stays_is_told_to_grow_once_in_a_hundred_at_most(blocks: int) -> None:
    rng = np.random.default_rng(6)
    courses = [trend(sizes(0.0, blocks, rng), 0.0, BLOCK * blocks, WALK) for _ in range(DRAWS)]
    assert sum(c.grows for c in courses if c) <= binom.ppf(0.999, DRAWS, 0.01)


def test_what_all_sizes_share_is_no_part_of_their_slope() -> None:
    """And where they are many, how large it is said to be does not matter either."""
    t, y, sd = np.array(sizes(1e-4, 400, np.random.default_rng(7))).T
    here = linear_trend(t - t[-1], y, sd)
    there = linear_trend(t - t[-1], y + 1.0, sd)
    assert (there.level - 1.0, there.rate) == pytest.approx((here.level, here.rate))
    twice = linear_trend(t - t[-1], y, 2.0 * sd)
    assert twice.rate_sd < 1.3 * here.rate_sd


def test_the_slope_of_a_walk_varies_as_is_foreseen() -> None:
    rng, runs, n = np.random.default_rng(8), 4000, 200
    walks = np.cumsum(rng.standard_normal((runs, n)), axis=1)
    slopes = np.polyfit(np.arange(n), walks.T, 1)[0]
    assert np.var(slopes) * n == pytest.approx(WALKED, rel=4.0 * np.sqrt(2.0 / runs))


def test_what_strays_blindly_has_to_grow_faster(shop: Shop) -> None:
    """Where nobody measures how warm joints are, all friction strays as far as its viscous part."""
    diagnosis = shop.diagnosis(shop.log(seconds=2.0))
    extent, healthy = diagnosis.slow.judge.extent, diagnosis.slow.healthy
    k = next(k for k, s in enumerate(extent.of.each) if s.kind.of_friction and s.joint == 1)
    was, lost = (np.zeros(3), np.eye(3)), np.zeros((4, healthy.space.joints))
    lost[:, 1] = 0.5, 0.5, 0.0, 1.0
    told = []
    for warm in (20.0, np.nan):
        walk = healthy.blind(np.full((3, healthy.space.joints), warm))
        nothing = np.zeros(0)
        block = Block(0.0, BLOCK, nothing, nothing, walk, lost=lost)
        fault, recall = Fault(k, -1.0, -1.0, 0.0, 0.1, was=was), SimpleNamespace(blocks=(block,))
        state = SimpleNamespace(known=(fault,), recall=recall)
        told.append(60.0 * extent.strays(state)[k])
    rules = healthy.rules
    f, alpha = (rules.healthy[name]["hour"] for name in ("f", "alpha"))
    blind = np.hypot(alpha, rules.warmth["blind"])
    np.testing.assert_allclose(told, 0.5 * np.hypot(f, [alpha, blind]))


def test_what_is_remembered_of_weeks_is_from_all_of_them() -> None:
    series, many = (), 3 * SERIES
    for k in range(many):
        series = thinned((*series, (BLOCK * k, 0.0, 0.1)))
    assert len(series) == SERIES and series[0][0] == 0.0
    t = np.array([level[0] for level in series])
    assert t[-RECENT:].tolist() == [BLOCK * k for k in range(many - RECENT, many)]
    assert np.diff(t).max() <= 2.0 * t[-1] / (SERIES - RECENT)


def test_a_level_that_is_passed_is_reached_now_though_the_change_may_not_grow() -> None:
    course = Course(t=0.0, size=0.6, size_sd=0.01, rate=0.001, rate_sd=0.002)
    assert course.until(0.5) == {"median": 0.0, "lo": 0.0, "hi": 0.0}
