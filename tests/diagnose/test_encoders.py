"""An encoder that is stuck or silent is told as that, and as nothing else."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from realarm import Recorded
from shop import Shop
from test_diagnosis_resumed import looking_on

from urdyn.diagnose import Diagnosis, Finding, diagnose, read_rules
from urdyn.diagnose.fast import encoder
from urdyn.diagnose.fast.encoder import all_seen, unseen, well
from urdyn.diagnose.fast.encoder_zero import shifted
from urdyn.diagnose.findings.ledger import entered, finding_of, to_be_told
from urdyn.estimate import EKF
from urdyn.identify import Fit
from urdyn.signal import samples
from urdyn.tracking import Tracker
from urdyn.types import Log

BEGIN, LASTS = 5.0, 1.5  # [s]
HOW = ("the same angle", "the same angle and velocity", "no angle")
LONG = pytest.mark.slow


def spoilt(log: Log, joint: int, how: str, begin: float = BEGIN, lasts: float = LASTS) -> Log:
    """The log with an encoder that tells nothing for a while."""
    q, v = log.joint("actual_q").copy(), log.joint("actual_qd").copy()
    rows = slice(*np.searchsorted(log.t - log.t[0], [begin, begin + lasts]))
    q[rows, joint] = np.nan if how == "no angle" else q[rows.start, joint]
    if how == "the same angle and velocity":
        v[rows, joint] = v[rows.start, joint]
    return replace(log, channels={**log.channels, "actual_q": q, "actual_qd": v})


def is_one(
    findings: tuple[Finding, ...], joint: int, onset: float, until: float | None = None
) -> None:
    """The finding is of that encoder, and has an end where that is known [s]."""
    (finding,) = findings
    assert (finding.kind, finding.joint, finding.quantity) == ("sensor_fault", joint, "encoder")
    assert finding.severity == ("warning" if until else "critical")
    if until:
        assert finding.evidence["until_s"] == pytest.approx(until, abs=0.1)
    assert onset <= finding.onset_s < onset + 0.3
    assert "encoder" in finding.text and "encoder" in finding.advice


@pytest.mark.parametrize(
    ("joint", "how"),
    [
        *zip((1, 5, 1), HOW, strict=True),
        *(pytest.param(*of, marks=LONG) for of in zip((5, 1, 5), HOW, strict=True)),
    ],
)
def test_it_is_one_finding(shop: Shop, joint: int, how: str) -> None:
    log = shop.log(seconds=10.0)
    onset = log.t[0] + BEGIN
    told = diagnose(shop.fit, spoilt(log, joint, how)).findings
    is_one(told, joint, onset, onset + LASTS)
    assert "was stuck or silent from" in told[0].text and "well since" in told[0].text


@pytest.mark.parametrize("joint", [1, *(pytest.param(j, marks=LONG) for j in (0, 2, 3, 4, 5))])
def test_so_it_is_in_a_real_run(real: Fit, recorded: Recorded, joint: int) -> None:
    log = recorded("ur-20_02_12-40sec_12harm", 500, 2000)
    told = diagnose(real, spoilt(log, joint, "the same angle", lasts=6.0)).findings
    is_one(told, joint, onset := log.t[0] + BEGIN, onset + 6.0)


def test_one_that_never_comes_back_is_told_all_the_same(shop: Shop) -> None:
    log = shop.log(seconds=8.0)
    told = diagnose(shop.fit, spoilt(log, 2, "no angle", lasts=60.0)).findings
    is_one(told, 2, log.t[0] + BEGIN)


def test_one_that_is_well_for_a_moment_only_is_ill_since_it_was_first(shop: Shop) -> None:
    """It flickers: .7 s of silence in every second, to the end."""
    log = shop.log(seconds=12.0)
    for begin in np.arange(BEGIN, 12.0):
        log = spoilt(log, 2, "no angle", begin, 0.7)
    (told,) = diagnose(shop.fit, log).findings
    assert told.severity == "critical" and "is stuck or silent since" in told.text
    assert told.evidence["times"] == 7
    assert told.onset_s - log.t[0] == pytest.approx(BEGIN, abs=0.1)


def test_an_encoder_that_tells_the_angle_at_which_it_was_stuck_is_not_well() -> None:
    """Where a joint stands nobody knows; it is when it has gone on."""
    state, silent, held = all_seen(2), np.array([False, True]), 0.2
    known, after = np.ones((100, 2), dtype=bool), 0.4 + 0.01 * np.arange(100)
    for t in (0.0, 0.1, 0.2, 0.3):
        state, _ = unseen(state, t, silent, known[0], held)
    state = encoder.seen(state, after, np.full((100, 2), 0.5), known)
    assert not well(state, 60.0)[1]
    ((told,), early) = (
        well(encoder.seen(state, after[:1], np.array([[0.5, 0.6]]), known[:1]), t)[1]
        for t in (60.0, 5.0)
    )
    assert (told.joint, told.evidence["until_s"], told.size) == (1, 0.3, 0.0) and not early


def test_where_all_of_them_tell_nothing_it_is_a_gap(shop: Shop) -> None:
    log = shop.log(seconds=12.0)
    q = log.joint("actual_q").copy()
    q[300:350] = np.nan
    assert not diagnose(shop.fit, replace(log, channels={**log.channels, "actual_q": q})).findings


def seen(shop: Shop, log: Log, folder: Path) -> Iterator[tuple[float, int]]:
    """How many findings there are while a run goes on; their last are kept in the folder."""
    period = float(np.median(np.diff(log.t)))
    tracker, looking = Tracker(shop.fit, EKF(), period), looking_on(shop, log)
    looking.begin(folder, 0, {"twin": "a"})
    state = tracker.init()
    for k, sample in enumerate(samples(log), 1):
        state, reading = tracker.step(state, sample)
        if reading:
            looking.take(reading)
        else:
            looking.miss(*tracker.missed(state))
        if k % 50 == 0:
            looking.keep(k)
            assert looking.kept(wait=True)
            yield sample.t, len(looking.findings)
    looking.finish()
    looking.close()


def test_it_is_told_though_no_instant_is_known_any_more(shop: Shop, tmp_path: Path) -> None:
    """Nor is the stream what fails: of the other joints currents are known."""
    log = shop.log(seconds=7.5)
    looking, silent = looking_on(shop, log), np.arange(6) == 2
    looking.begin(tmp_path, 0, {"twin": "a"})
    for k in range(5000):
        looking.miss(0.01 * k, silent, np.where(silent, np.nan, 1.0))
        if looking.findings:
            break
        time.sleep(0.002)
    looking.close()
    (finding,) = looking.findings
    assert (finding["joint"], finding["severity"]) == (2, "critical")
    assert finding["evidence"]["at_once"] == 1


@pytest.mark.parametrize("how", [HOW[0], *(pytest.param(how, marks=LONG) for how in HOW[1:])])
def test_it_is_told_while_it_lasts(shop: Shop, how: str, tmp_path: Path) -> None:
    log = spoilt(shop.log(seconds=7.5, rate=100.0), 2, how)
    told = np.array(list(seen(shop, log, tmp_path)))
    since = told[:, 0] - log.t[0] - BEGIN
    assert not told[since < 0.0, 1].any()
    assert (told[since > 0.7, 1] == 1).all()


def test_a_noisy_encoder_jumps_to_and_fro_and_is_off_by_no_sum(shop: Shop) -> None:
    """Each of its jumps is noise: what they add up to is nothing that its zero is off by."""
    where, rules, book = Diagnosis(shop.fit, 0.01).space, read_rules(), ()
    for second, jump in enumerate([0.011, 0.008, -0.016, 0.014, -0.010, -0.013]):
        rows = SimpleNamespace(t=np.array([float(second)]), shift=jump * np.eye(6)[2:3])
        [event] = shifted(rows, rules.jump)
        book, [found] = entered(book, [finding_of(event, book, where, rules)])
    assert len(book) == 1 and (found.onset_s, found.size) == (0.0, 0.013)
    assert "to and fro" in found.text and "loose contact" in found.advice


def test_a_zero_that_jumps_much_further_is_told_again(shop: Shop) -> None:
    """Nobody knows the sd of such a size, which is no reason to keep it quiet."""
    where, rules, book, again = Diagnosis(shop.fit, 0.01).space, read_rules(), (), list[bool]()
    for t, jump in ((0.0, 0.011), (60.0, 0.001), (120.0, 0.3)):
        rows = SimpleNamespace(t=np.array([t]), shift=jump * np.eye(6)[2:3])
        [event] = shifted(rows, rules.jump)
        before, (book, found) = book, entered(book, [finding_of(event, book, where, rules)])
        again.append(bool(to_be_told(before, found)))
    assert again == [True, False, True]
