"""Laws of outlier rejection: what is marked, what never is, and the count."""

from __future__ import annotations

import numpy as np
import pytest
from plain_logs import clock, counts, log_of
from scipy.stats import binom, norm

from urdyn.signal import (
    hampel,
    reject_outliers,
)
from urdyn.signal.outliers import _window_of


@pytest.mark.parametrize("robust", [False, True])
def test_three_sigma_marks_as_many_as_a_normal_variable_has(robust: bool) -> None:
    n = 60000
    x = np.random.default_rng(4).normal(size=(n, 1))
    marked = np.isnan(
        reject_outliers(log_of(clock(100, n / 100)[:-1], actual_current=x), robust=robust).channels[
            "actual_current"
        ]
    ).sum()
    # a spread that is 1 % wrong (MAD at this length) moves the rate by 10 %
    rate, slack = 2 * norm.sf(3), 1.1 if robust else 1.0
    assert binom.ppf(1e-4, n, rate / slack) <= marked <= binom.ppf(1 - 1e-4, n, rate * slack)


def test_outliers_are_counted_and_only_marked() -> None:
    x = np.random.default_rng(5).normal(size=(500, 2))
    x[100, 1] = 50.0
    log = log_of(clock(100, 4.99), actual_q=x, robot_mode=x[:, 1])
    out = reject_outliers(log, sigma=6)
    assert np.argwhere(np.isnan(out.channels["actual_q"])).tolist() == [[100, 1]]
    assert counts(out) == {"outlier beyond 6 sigma": 1}
    assert out.channels["robot_mode"][100] == 50.0


def test_three_sigma_finds_nothing_among_ten_and_the_median_does() -> None:
    x = np.zeros((10, 1))
    x[:, 0] = np.arange(10) / 10
    x[5] = 1e6
    log = log_of(clock(100, 0.09), actual_q=x)
    assert np.isfinite(reject_outliers(log).channels["actual_q"]).all()
    marked = reject_outliers(log, robust=True).channels["actual_q"]
    assert np.flatnonzero(np.isnan(marked)).tolist() == [5]


def test_hampel_finds_the_spikes_of_a_moving_joint_and_nothing_else() -> None:
    t = clock(100, 10.0)
    x = np.sin(t)[:, None]
    x[[0, 300, 301, 700]] += 0.5
    out = hampel(log_of(t, actual_q=x), sigma=5)
    assert np.flatnonzero(np.isnan(out.channels["actual_q"])).tolist() == [0, 300, 301, 700]


def test_a_moving_window_does_not_see_across_a_gap() -> None:
    t = clock(100, 1.0)[:100]
    t[50:] += 9.0
    x = np.random.default_rng(6).normal(size=(100, 1))
    x[50:] += 100.0
    out = reject_outliers(log_of(t, actual_q=x), window=41, sigma=5)
    assert np.isfinite(out.channels["actual_q"]).all()


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("window", [None, 21])
def test_rest_and_silence_hold_no_outliers(robust: bool, window: int | None) -> None:
    rest, silence = np.full((200, 1), 0.1), np.full((200, 1), np.nan)
    log = log_of(clock(100, 1.99), actual_q=rest, actual_qd=silence)
    out = reject_outliers(log, robust=robust, window=window)
    assert np.array_equal(out.channels["actual_q"], rest)
    assert np.isnan(out.channels["actual_qd"]).all()
    assert not out.defects


@pytest.mark.parametrize("size", [4, 5, 6, 20, 21])
def test_every_row_is_in_its_own_window(size: int) -> None:
    rows = np.arange(30)
    first = _window_of(30, size)
    assert ((first <= rows) & (rows < first + size)).all() and first.max() == 30 - size
