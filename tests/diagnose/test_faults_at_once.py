"""What is known of one fault leaves the others, and the load, as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose import Diagnosis, Finding
from urdyn.diagnose.findings.ledger import Book
from urdyn.diagnose.kinds.rules_file import read_rules
from urdyn.diagnose.kinds.suspects import suspects
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.slow import onsets
from urdyn.diagnose.slow.ailing import Ailing
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.healthy import Healthy
from urdyn.diagnose.slow.onsets import Block, Straying
from urdyn.diagnose.slow.recall import Recall

LENGTH = 5.0  # [s] of a block


def _found(
    shop: Shop, *faults: str, seconds: float, rate: float = 100.0
) -> list[tuple[str, int | None]]:
    report = shop.report(*faults, seconds=seconds, rate=rate)
    return sorted(((f.kind, f.joint) for f in report), key=str)


def test_a_bias_of_many_frictions_is_one_finding_and_no_load(shop: Shop) -> None:
    biased = "sensor_fault:joint=4,mode=biased,size=2,onset=25"
    assert _found(shop, biased, seconds=70.0, rate=25.0) == [("sensor_fault", 4)]


@pytest.mark.slow
def test_friction_that_rises_with_another_load_is_found_beside_it(shop: Shop) -> None:
    faults = ("friction_increase:joint=3,onset=25,rate=0.6,shape=step",)
    both = _found(shop, *faults, "payload_change:onset=25,mass=1.5", seconds=90.0)
    assert both == [("friction_increase", 3), ("payload_change", None)]


@pytest.mark.slow
def test_a_bias_hides_no_other_fault(shop: Shop) -> None:
    faults = ("health_degradation:joint=1,onset=25,rate=0.2,shape=step",)
    both = _found(shop, *faults, "sensor_fault:joint=4,mode=biased,size=2,onset=25", seconds=90.0)
    assert both == [("health_degradation", 1), ("sensor_fault", 4)]


def _told(healthy: Healthy, truth: np.ndarray, k: int, begin: float) -> Block:
    """A block that tells every state as well as the first day does, and state k ten times so."""
    A = np.diag(1.0 / np.diag(healthy.first[1] + 1e-12 * np.eye(healthy.size)))
    A[k, k] *= 100.0
    return Block(begin, begin + LENGTH, A, A @ truth)


@pytest.mark.parametrize("divided", [False, True])
def test_a_fault_that_is_known_began_at_its_onset_and_nowhere_else(
    shop: Shop, divided: bool
) -> None:
    """Of a block that it divides all states seem off, for none explains both its parts."""
    rules = read_rules()
    where = space(shop.fit)
    of = suspects(where, rules.slow)
    healthy = Healthy(where, rules, of)
    k = next(i for i, s in enumerate(of.each) if (s.kind.name, s.joint) == ("sensor_fault", 2))
    suspect = of.each[k]
    at, change = int(of.states[suspect.places[0]]), 9.0 * float(suspect.sd[0])
    recall, sound = Recall(np.nan, *healthy.first), Ailing(healthy, (), np.ones(where.joints))
    for n in range(8):
        truth = np.zeros(healthy.size)
        truth[at] = change * (n >= 4)
        if divided and n == 4:
            truth = 9.0 * np.sqrt(np.diag(healthy.first[1]))
        block = _told(healthy, truth, at, LENGTH * n)
        recall = recall.after(block, sound)
    known = (Fault(k, 4 * LENGTH, 4 * LENGTH, 5 * LENGTH, change),)
    arm = replace(sound, known=known)
    for n, (_, x, P) in enumerate(recall.course(arm)):
        assert abs(x[at] - change * (n >= 4)) < 3.0 * np.sqrt(P[at, at])
    bank = recall.again(arm, of.directions(healthy.size))
    others = np.delete(bank.x, at)
    assert np.abs(others / np.sqrt(np.delete(np.diag(bank.P), at) + 1e-12)).max() < 1.0


def test_what_is_gone_and_comes_back_is_another_fault(shop: Shop) -> None:
    """With an onset, an alarm and a course of its own, and told as any other is."""
    diagnosis = Diagnosis(shop.fit, 0.01)
    judge, ledger, slow = diagnosis.slow.judge, diagnosis.ledger, diagnosis.slow.init()
    at, begins = diagnosis.space.places["z"].start + 2, (4, 18)
    book, told = Book(), list[Finding]()
    for n in range(22):
        truth, arm = np.zeros(judge.healthy.size), slow.arm(judge.healthy)
        truth[at] = -0.25 * (begins[0] <= n < 15 or n >= begins[1])
        block = arm.leaping(_told(judge.healthy, truth, at, LENGTH * n))
        bank = onsets.step(slow.bank, block, arm.straying, judge.E, slow.waited > 0)
        recall = slow.recall.after(block, arm)
        slow = judge.judged(replace(slow, bank=bank, recall=recall, found=()))
        book, new = ledger.changes(book, slow)
        book, slow = ledger.closed(book, slow)
        told += new
    first, gone, back = told
    assert [f.gone for f in told] == [False, True, False]
    assert gone.onset_s == first.onset_s and back.onset_s > gone.onset_s
    for finding, begin in ((first, LENGTH * begins[0]), (back, LENGTH * begins[1])):
        lo, hi = finding.onset_interval_s
        assert lo <= begin <= hi <= finding.alarm_s and finding.size == pytest.approx(
            -0.2, abs=0.01
        )


def test_what_may_have_leapt_is_believed_as_a_wider_prior_says() -> None:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((3, 3))
    A, b, P = root @ root.T, rng.standard_normal(3), np.diag([0.5, 1.0, 2.0])
    leap = np.array([0.0, 3.0, 0.0])
    still = Straying(np.zeros(3), np.zeros(3))
    _, x, cov = onsets.followed(0.0, np.zeros(3), P, Block(1.0, 2.0, A, b, leap=leap), still)
    expected = np.linalg.inv(A + np.linalg.inv(P + np.diag(leap**2)))
    assert np.allclose(cov, expected) and np.allclose(x, expected @ b)
