"""How soon a ramp is found, against an oracle that is told it."""

from __future__ import annotations

import numpy as np
import pytest

from urdyn.bench.fault_trials import _outcome, first_alarms
from urdyn.faults import ShiryaevRoberts, Whitened, calibrated, learn_baseline, oracle_cusum
from urdyn.simulate import paper
from urdyn.types import Array

PROMISE, ONSET, AFTER = 10_000.0, 50, 70
WARNING = 40  # [steps] after the onset


def delays(first: Array) -> Array:
    """Of runs without an alarm before the onset [steps]."""
    return first[first >= ONSET] + 1 - ONSET


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.25])
def test_nearly_as_soon_as_an_oracle(ratio: float) -> None:
    """400 lives: the mean delay to two standard errors of both means, found to those of .99."""
    rng, runs = np.random.default_rng(1), 400
    grown = ratio * np.maximum(np.arange(ONSET + AFTER) - ONSET + 1.0, 0.0)[:, None]
    y = rng.standard_normal((ONSET + AFTER, runs)) + grown
    threshold = calibrated(oracle_cusum(rng.standard_normal((1000, 1200)), ratio), PROMISE)
    over = oracle_cusum(y, ratio) >= threshold
    oracle = delays(np.where(over.any(axis=0), over.argmax(axis=0), len(y)))
    baseline = learn_baseline(rng.standard_normal((1000, runs)))
    ours = delays(first_alarms(Whitened(baseline, ShiryaevRoberts(PROMISE / runs)), y))
    chance = 2.0 * np.hypot(oracle.std(), ours.std()) / np.sqrt(runs)
    assert ours.mean() < 1.25 * oracle.mean() + chance
    assert (ours <= WARNING).mean() > 0.99 - 2.0 * np.sqrt(0.01 * 0.99 / runs)


def test_the_oracle_keeps_its_own_promise() -> None:
    """A threshold from some healthy runs, on others: 500 runs, three standard errors of .095."""
    rng = np.random.default_rng(2)
    threshold = calibrated(oracle_cusum(rng.standard_normal((300, 1500)), 0.25), 3000.0)
    alarmed = (oracle_cusum(rng.standard_normal((300, 1500)), 0.25).max(axis=0) >= threshold).mean()
    allowed = 1.0 - np.exp(-0.1)
    assert abs(alarmed - allowed) < 3.0 * np.sqrt(2.0 * allowed * (1.0 - allowed) / 1500)


def test_a_delay_is_one_step_where_the_first_row_that_grew_alarms() -> None:
    """Row k is step k + 1, and at the onset itself nothing is wrong yet; earlier alarms are out."""
    assert paper.FRICTION_INCREASE.onset == paper.ONSET
    first = np.array([paper.ONSET - 1, paper.ONSET, paper.WARNING_STEP - 1])
    ever = paper.WARNING_STEP - paper.ONSET
    assert _outcome(first, np.zeros((200, 3))) == (1.0, (1 + ever) / 2, 2)
    assert _outcome(first[1:] + 1, np.zeros((200, 2))) == (0.5, (3 + ever) / 2, 2)
