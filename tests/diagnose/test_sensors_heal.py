"""A sensor that was silent, and speaks again, is told as that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from realarm import with_current
from shop import Shop

from urdyn.diagnose import Report, diagnose, read_rules
from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.event import Event
from urdyn.diagnose.recommend import recommendation
from urdyn.diagnose.verdict import of_event


def _silent(shop: Shop, *spans: tuple[float, float], seconds: float = 14.0) -> tuple[Report, float]:
    """What is told of a sensor that is silent in these spans [s], and when its log begins [s]."""
    log = shop.log(seconds=seconds)
    current = log.joint("actual_current").copy()
    for begin, end in spans:
        current[(log.t - log.t[0] > begin) & (log.t - log.t[0] < end), 2] = np.nan
    return diagnose(shop.fit, with_current(log, current)), float(log.t[0])


def test_a_sensor_that_speaks_again_was_silent_for_so_long_and_is_no_critical_finding(
    shop: Shop,
) -> None:
    report, begin = _silent(shop, (4.0, 5.0))
    [found] = report
    assert (found.kind, found.joint, found.severity) == ("sensor_fault", 2, "warning")
    assert "was silent from" in found.text and "is well since" in found.text
    assert "loose contact" in found.advice
    assert found.onset_s - begin == pytest.approx(4.0, abs=0.05)
    assert found.evidence["until_s"] - begin == pytest.approx(5.0, abs=0.3)  # a beat
    assert found.alarm_s - begin < 4.5


@pytest.mark.parametrize("spans", [((4.0, 5.0), (10.0, 14.0)), ((11.5, 13.0),)])
def test_a_sensor_that_is_silent_anew_or_was_so_just_now_is_not_well(
    shop: Shop, spans: tuple[tuple[float, float], ...]
) -> None:
    report, begin = _silent(shop, *spans)
    [found] = report
    assert found.severity == "critical" and "is silent since" in found.text
    assert found.onset_s - begin == pytest.approx(spans[0][0], abs=0.05)


def test_one_that_is_silent_anew_tells_since_when_and_that_it_was_before(shop: Shop) -> None:
    report, begin = _silent(shop, (4.0, 5.0), (12.0, 14.0))
    [found] = report
    assert f"is silent since stamp {begin + 12.0:.1f} s, and was before" in found.text
    assert found.evidence["anew_s"] - begin == pytest.approx(12.0, abs=0.05)


def test_several_silences_are_told_as_so_many_and_how_long_the_longest_was(shop: Shop) -> None:
    report, begin = _silent(shop, (3.0, 3.3), (5.0, 5.5), (5.7, 5.72), (7.0, 7.2))
    [found] = report
    assert found.evidence["times"] == 3 and "was silent 3 times" in found.text
    assert found.evidence["longest_s"] == pytest.approx(0.5, abs=0.02)
    assert (found.onset_s - begin, found.severity) == (pytest.approx(3.0, abs=0.05), "warning")
    assert found.evidence["until_s"] - begin == pytest.approx(7.2, abs=0.3)


def test_what_is_lost_of_many_joints_is_the_streams_defect_and_no_service_is_due(
    shop: Shop,
) -> None:
    log = shop.log(seconds=12.0)
    channels = {name: log.joint(name).copy() for name in ("actual_q", "actual_current")}
    rng = np.random.default_rng(0)
    for k, begin in enumerate(np.arange(2.0, 11.5, 0.5)):
        rows = slice(*np.searchsorted(log.t - log.t[0], [begin, begin + rng.uniform(0.3, 0.45)]))
        name = ("actual_q", "actual_current")[k % 2]
        channels[name][rows, rng.permutation(6)[:2]] = np.nan
    report = diagnose(shop.fit, replace(log, channels={**log.channels, **channels}))
    assert len({found.joint for found in report}) > 2
    assert {found.severity for found in report} == {"warning"}
    assert all("recorder" in found.advice for found in report)
    assert recommendation(report.findings, read_rules().costs)["advice"] == "never"


def test_a_sensor_that_is_stuck_is_so_though_its_joint_does_not_show_it(shop: Shop) -> None:
    """A value that stays the same where nobody slides is none of one that is well."""
    log = shop.log("sensor_fault:joint=2,onset=3,mode=stuck", seconds=14.0)
    [found] = diagnose(shop.fit, log)
    assert found.severity == "critical" and "is stuck at" in found.text


@pytest.mark.parametrize(
    ("until", "words"),
    [(1012.9, "was silent from stamp 1012.3 s to 1012.9 s"), (1012.34, "silent at stamp 1012.3 s")],
)
def test_a_moment_of_silence_is_not_told_from_a_stamp_to_the_same(
    shop: Shop, until: float, words: str
) -> None:
    evidence = {"mode": "dropped", "until_s": until}
    event = Event("sensor_fault", 2, 1012.26, 1012.4, 0.9, 0.0, evidence)
    rules = read_rules()
    assert words in of_event(event, Diagnosis(shop.fit, 0.01, rules).space, rules).text
