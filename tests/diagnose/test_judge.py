"""An alarm is told of what explains it, or not yet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose import Diagnosis
from urdyn.diagnose.findings.verdict import _gone
from urdyn.diagnose.kinds.change import Push
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.kinds.suspects import Suspect, suspects
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.slow import onsets
from urdyn.diagnose.slow.ailing import Ailing
from urdyn.diagnose.slow.explanation import Explanation, _began, gathered, ratios
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.judge import _shadow
from urdyn.diagnose.slow.slow import Slow


def test_a_change_that_is_too_small_to_be_told_is_not_told_by_another_name(shop: Shop) -> None:
    of = suspects(space(shop.fit), read_rules().slow)

    def one(kind: str, joint: int) -> Suspect:
        return next(s for s in of.each if s.kind.name == kind and s.joint == joint)

    def told(suspect: Suspect, evidence: float, share: float) -> Explanation:
        kind, span, began = suspect.kind, (0.0, 2.0), (0.0, 1.0, 2.0)
        size = share * kind.sign * kind.least * suspect.unit
        return Explanation(
            suspect, 9.0, evidence, "ramp", 1.0, span, began, size, 0.1 * size, 0.0, 0.0, False
        )

    friction = told(one("friction_increase", 5), 20.0, 0.97)
    health = told(one("health_degradation", 5), 18.8, 1.2)
    elsewhere = told(one("health_degradation", 4), 18.8, 1.2)
    assert not friction.large and health.large
    assert _shadow(health, (friction, health))
    assert not _shadow(elsewhere, (friction, elsewhere))
    grown = told(one("friction_increase", 5), 20.0, 1.1)
    assert not _shadow(health, (grown, health)) and not _shadow(grown, (grown, health))
    assert np.isclose(grown.size, 1.1 * 0.03)
    assert not told(one("friction_increase", 5), 20.0, -1.1).large  # it grows, or is none


def test_a_change_began_as_near_its_first_block_as_no_other_block_was_nearer() -> None:
    edges, reach = 5.0 * np.arange(7.0), 5.0 * (1.0 - np.sqrt(0.1))  # of 90 % of a hat
    sure = np.eye(6)
    assert _began(edges, sure[2]) == pytest.approx((10.0 - reach, 10.0, 10.0 + reach), abs=0.02)
    assert _began(edges, sure[0])[0] > 0.0  # nothing began before the first
    assert _began(edges, sure[5])[2] < 30.0  # nor after the last is over
    assert _began(edges, np.full(6, 1.0 / 6.0)) == pytest.approx((1.5, 12.5, 27.5), abs=1.5)


def test_a_change_of_which_two_blocks_are_as_likely_the_first_began_between_them() -> None:
    """Its median is of the same distribution as its interval, and so within it."""
    lo, middle, hi = _began(5.0 * np.arange(4.0), np.array([0.0, 0.5001, 0.4999]))
    assert middle == pytest.approx(7.5, abs=0.01) and hi - middle == pytest.approx(
        middle - lo, rel=0.01
    )


def test_a_bank_that_has_just_begun_speaks_against_nothing(shop: Shop) -> None:
    of, size = suspects(space(shop.fit), read_rules().slow), space(shop.fit).size
    bank = onsets.first(np.zeros(size), np.eye(size), len(of.states))
    evidence = gathered(bank, ratios(bank, of))
    assert evidence.shape == (len(of.each),) and (evidence == -np.inf).all()


@pytest.mark.parametrize(("share", "nothing"), [(0.4, True), (0.6, False)])
def test_a_change_of_which_too_little_is_left_to_be_told_is_none(
    shop: Shop, share: float, nothing: bool
) -> None:
    """Another finding has the rest of it, however surely that little is there."""
    slow = shop.diagnosis(shop.log(seconds=1.0)).slow
    judge = slow.judge
    kinds = [(s.kind.name, s.joint) for s in judge.of.each]
    k = kinds.index(("sensor_fault", 1))
    suspect, size = judge.of.each[k], judge.healthy.space.size
    x = np.zeros(size)
    x[judge.of.states[suspect.places[0]]] = share * suspect.kind.least * suspect.unit
    bank = onsets.first(x, 1e-12 * np.eye(size), len(judge.of.states))
    fault = Fault(k, 0.0, 1.0, 2.0, 3.0 * suspect.kind.least * suspect.unit)
    assert judge._nothing(replace(slow.init(), bank=bank), fault) == nothing


@pytest.mark.parametrize(("reported", "taken"), [(3.0, True), (0.4, False)])
def test_what_was_never_told_to_be_more_than_is_left_of_it_is_not_taken_back(
    shop: Shop, reported: float, taken: bool
) -> None:
    slow = shop.diagnosis(shop.log(seconds=1.0)).slow
    judge, size = slow.judge, slow.judge.healthy.space.size
    k = [(s.kind.name, s.joint) for s in judge.of.each].index(("sensor_fault", 1))
    suspect = judge.of.each[k]
    least, x = suspect.kind.least * suspect.unit, np.zeros(size)
    x[judge.of.states[suspect.places[0]]] = 0.4 * least
    bank = replace(onsets.first(x, 1e-12 * np.eye(size), len(judge.of.states)), t=3.0)
    state, fault = replace(slow.init(), bank=bank), Fault(k, 0.0, 1.0, 2.0, reported * least)
    assert judge._nothing(state, fault) and judge._taken_back(state, fault) == taken


@pytest.mark.parametrize("viscous", [0.0, -0.3])
def test_friction_of_which_one_term_makes_up_for_the_other_is_none(
    shop: Shop, viscous: float
) -> None:
    """It is told as all friction of its joint, of which half is Coulomb and half viscous here."""
    slow, joint = shop.diagnosis(shop.log(seconds=1.0)).slow, 1
    judge, places, size = slow.judge, slow.space.places, slow.healthy.size
    k = [(s.kind.name, s.joint) for s in judge.of.each].index(("friction_increase", joint))
    x, P = np.zeros(size), 1e-6 * np.eye(size)
    x[places["f"].start + joint], x[places["alpha"].start + joint] = 0.3, viscous
    bank = replace(onsets.first(x, P, len(judge.of.states)), t=20.0)
    lost = np.outer([1.0, 1.0, 0.0, 2.0], np.ones(6))
    block = onsets.Block(15.0, 20.0, 0.0 * P, 0.0 * x, lost=lost)
    state = slow.init()
    state = replace(state, bank=bank, recall=replace(state.recall, blocks=(block,)))
    was = np.zeros(3), 1e-6 * np.eye(3)
    fault = Fault(k, 10.0, 12.0, 20.0, 0.3, was=was)
    assert judge._nothing(state, fault) == judge._taken_back(state, fault) == (viscous < 0.0)


def test_viscous_friction_is_part_of_friction_and_of_nothing_else(shop: Shop) -> None:
    of = suspects(space(shop.fit), read_rules().slow).each
    pairs = [(a, b) for a in of for b in of if a.part_of(b)]
    kinds = {(a.kind.name, b.kind.name) for a, b in pairs}
    assert kinds == {("viscous_friction", "friction_increase")}
    assert [(a.joint, b.joint) for a, b in pairs] == [(j, j) for j in range(6)]


def test_friction_that_one_term_names_may_have_grown_in_each(shop: Shop) -> None:
    """It is sized whole: a term held where it was before would make up for none of the others."""
    healthy = shop.diagnosis(shop.log(seconds=2.0)).slow.healthy
    told = [
        Fault(k, 5.0, 10.0, 20.0, 0.6)
        for name in ("viscous_friction", "friction_increase")
        for k, s in enumerate(healthy.of.each)
        if (s.kind.name, s.joint) == (name, 2)
    ]
    _, P = healthy.first
    arms = [Ailing(healthy, (fault,), np.ones(6)) for fault in told]
    part, whole = (arm.opened(P, 20.0) for arm in arms)
    assert np.array_equal(part, whole) and not np.array_equal(part, P)
    part, whole = (arm.straying.walk for arm in arms)
    assert np.array_equal(part, whole) and not np.array_equal(part, healthy.straying.walk)


def test_an_alarm_that_waited_for_what_was_taken_back_since_is_none(shop: Shop) -> None:
    slow = Slow(space(shop.fit), 0.02, read_rules())
    state = replace(slow.init(), waited=1)
    assert slow.judge.concluded(state) is state
    assert not slow.concluded(state, Push()).found


@pytest.mark.parametrize("t", [np.nan, 3600.0])
def test_what_begins_once_the_load_is_another_is_as_old_as_that_at_most(
    shop: Shop, t: float
) -> None:
    diagnosis = Diagnosis(shop.fit, 0.01)
    slow = diagnosis.slow.init()
    slow = replace(slow, bank=replace(slow.bank, t=t), recall=replace(slow.recall, t=t))
    assert diagnosis.slow.judge.afresh(slow).bank.oldest == np.isnan(t)


def test_a_change_that_grows_slowly_is_never_gone_and_one_that_is_repaired_is(shop: Shop) -> None:
    of, rng, sd = suspects(space(shop.fit), read_rules().slow), np.random.default_rng(0), 0.025
    friction = next(s for s in of.each if s.kind.name == "friction_increase")
    for _ in range(20):
        size = np.linspace(0.0, 0.08, 200) + 0.5 * sd * rng.standard_normal(200)
        worn = [(5.0 * k, float(x), sd) for k, x in enumerate(size)]
        assert not any(_gone(friction, worn[:k]) for k in range(100, 201))
        assert _gone(friction, [*worn[:150], *((750.0, 0.2, sd),) * 200, (1750.0, 0.01, sd)])
