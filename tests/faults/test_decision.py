"""Service now, later, or never."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdyn.errors import InputError
from urdyn.faults import Costs, decide, forecast, outlook, stated_baseline

COSTS = Costs()


def chosen(median: float, spread: float = 2.0, confidence: float = 1.0, costs: Costs = COSTS):
    return decide(*outlook(costs, confidence, median, median / spread, median * spread), costs)


def test_what_grows_nowhere_is_left_alone():
    decision = decide(*outlook(COSTS), COSTS)
    assert decision.advice == "never"
    assert decision.never == 0.0


def test_what_fails_before_a_planned_service_is_serviced_now():
    assert chosen(COSTS.notice).advice == "now"


def test_what_fails_weeks_later_waits_for_a_planned_service():
    decision = chosen(500.0)
    assert decision.advice == "later"
    assert COSTS.notice <= decision.later_at < 500.0


def test_what_fails_far_beyond_the_horizon_is_left_alone():
    assert chosen(100.0 * COSTS.horizon).advice == "never"


def test_a_known_hour_of_failure_is_met_just_before():
    # With no doubt the best moment is the last of the grid before the failure.
    t, _ = outlook(COSTS)
    decision = decide(t, (t > 700.0).astype(float), COSTS)
    assert decision.later_at == t[t <= 700.0][-1]
    unused = COSTS.horizon - decision.later_at
    assert decision.later == pytest.approx(COSTS.service * (1.0 + unused / COSTS.life))


@pytest.mark.parametrize("lo", [0.0, 1.0, 400.0])
def test_one_in_twenty_fails_by_the_lower_limit_and_few_soon_after(lo):
    t, failed = outlook(COSTS, 1.0, 1000.0, lo, 2000.0)
    told = np.interp([lo, lo + 24.0, 1000.0, 2000.0], t, failed)
    few = 0.05 + 24.0 * 0.45 / (1000.0 - lo)  # the density rises up to the median
    assert told[[0, 2, 3]] == pytest.approx([0.05, 0.5, 0.95], abs=1e-3)  # to a step of the outlook
    assert told[1] < few


@given(median=st.floats(1.0, 1e5), spread=st.floats(1.01, 10.0), sure=st.floats(0.0, 1.0))
def test_costs_are_those_of_a_simulated_fleet(median, spread, sure):
    """Oracle: the expectation over failure times drawn from the same distribution.

    A service now forestalls what is due at once.
    """
    t, failed = outlook(COSTS, sure, median, median / spread, median * spread)
    decision = decide(t, failed, COSTS)
    u = (np.arange(20_000) + 0.5) / 20_000
    tau = np.interp(u, failed, t, right=np.inf)

    def cost(at: float, price: float) -> float:
        lived = np.minimum(tau, at)
        paid = np.where((tau <= at) & (at > 0.0), COSTS.failure, price)
        return float(np.mean(paid + COSTS.service * (COSTS.horizon - lived) / COSTS.life))

    # Quantiles and the trapezoid rule are one part in 20,000 and in 800 off; costs are at most 10.
    assert decision.now == pytest.approx(cost(0.0, COSTS.stop), abs=0.02)
    assert decision.later == pytest.approx(cost(decision.later_at, COSTS.service), abs=0.02)
    never = np.where(tau <= COSTS.horizon, COSTS.failure, 0.0)
    renewed = COSTS.service * np.maximum(COSTS.horizon - tau, 0.0) / COSTS.life
    assert decision.never == pytest.approx(float(np.mean(never + renewed)), abs=0.02)


def test_a_forecast_that_may_never_cross_is_decided_by_all_that_it_says():
    """A ramp that seems to have stopped, one step an hour: without a median, yet not left alone."""
    t = np.arange(1.0, 141.0)
    ramp = 0.0025 * np.clip(t - 100.0, 0.0, 25.0)
    y = ramp + 0.025 * np.random.default_rng(21).standard_normal(140)
    made = forecast(y, stated_baseline(0.0, 0.025), 0.10, 0.15)[0]
    assert made.critical.median == np.inf
    at = outlook(COSTS)[0][::8]
    decision = decide(at, made.failed(at), COSTS)
    assert decision.advice != "never"
    assert decision.never >= COSTS.failure * (1.0 - made.health(COSTS.horizon))


def test_a_level_that_is_passed_is_due_at_once_however_that_is_said():
    """The joint is at work, so what was forecast for the past has not ended it."""
    healthy = 0.1 + 0.01 * np.random.default_rng(22).standard_normal(1000)
    y = 0.1 + 0.002 * np.maximum(np.arange(120.0) - 20.0, 0.0)
    made = forecast(y + 0.01 * np.random.default_rng(23).standard_normal(120), healthy, 0.2, 0.25)
    at = outlook(COSTS)[0]
    passed, soon = decide(at, made[0].failed(at), COSTS), chosen(1e-3)
    assert made[0].failed(at)[0] > 0.999 and passed.advice == soon.advice == "now"
    told = [[d.now, d.later, d.never] for d in (passed, soon)]
    # A failure within the first step of the outlook, 0.06 h, is one to the trapezoid rule.
    assert told[0] == pytest.approx(told[1], abs=1e-4)


@given(median=st.floats(1.0, 1e5), more=st.floats(1.0, 100.0))
def test_dearer_failures_are_never_left_alone_more_readily(median, more):
    dear = Costs(failure=COSTS.failure * more)
    if chosen(median).advice != "never":
        assert chosen(median, costs=dear).advice != "never"


@pytest.mark.parametrize("wrong", [{"service": 0.0}, {"life": np.nan}, {"notice": 3000.0}])
def test_costs_that_make_no_sense_are_refused(wrong):
    with pytest.raises(InputError):
        Costs(**wrong)
