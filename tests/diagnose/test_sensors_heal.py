"""A sensor that was silent, and speaks again, is told as that; and so is one that clips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from realarm import with_current
from scipy.signal import lfilter
from shop import Shop

from urdyn.diagnose import Report, diagnose, read_rules
from urdyn.diagnose.diagnosis import Diagnosis
from urdyn.diagnose.fast import sensor_signs
from urdyn.diagnose.fast.sensor import BELIEVED
from urdyn.diagnose.findings.event_finding import of_event
from urdyn.diagnose.findings.recommend import recommendation
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.residual.rows import Rows
from urdyn.types import MAD_TO_SD


def _silent(
    shop: Shop, *spans: tuple[float, float], seconds: float = 14.0, rate: float = 50.0
) -> tuple[Report, float]:
    """What is told of a sensor that is silent in these spans [s], and when its log begins [s]."""
    log = shop.log(seconds=seconds, rate=rate)
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
    report, begin = _silent(shop, (3.0, 3.3), (5.0, 5.5), (5.7, 5.72), (7.0, 7.2), rate=100.0)
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
    [
        (1012.9, "was silent from stamp 1012.26 s to 1012.90 s"),
        (1012.264, "silent at stamp 1012.26 s"),
    ],
)
def test_a_moment_of_silence_is_not_told_from_a_stamp_to_the_same(
    shop: Shop, until: float, words: str
) -> None:
    evidence = {"mode": "dropped", "until_s": until}
    event = Event("sensor_fault", 2, 1012.26, 1012.4, 0.0, 0.9, evidence)
    rules = read_rules()
    assert words in of_event(event, Diagnosis(shop.fit, 0.01, rules).space, rules).text


@pytest.mark.parametrize("name", ["actual_q", "actual_current"])
@pytest.mark.parametrize("others", [[], [4]])
def test_sensors_that_fall_silent_at_the_same_row_are_the_streams_and_one_alone_is_its_own(
    shop: Shop, name: str, others: list[int]
) -> None:
    """From the first alarm on, before anybody knows that it comes back: nothing comes after it."""
    log = shop.log(seconds=8.0)
    lost, of_another = log.joint(name).copy(), log.joint("actual_current").copy()
    rows = log.t - log.t[0] > 7.0
    lost[rows, 2] = of_another[rows, 2] = np.nan
    of_another[np.ix_(rows, others)] = np.nan
    if name == "actual_current":
        lost = of_another
    channels = {**log.channels, "actual_current": of_another, name: lost}
    report = diagnose(shop.fit, replace(log, channels=channels))
    assert {f.severity for f in report} == {"warning" if others else "critical"}
    assert all(("recorder" in f.advice) == bool(others) for f in report)


def test_a_current_that_a_log_never_had_is_its_recorders_and_no_service_is_due(shop: Shop) -> None:
    report, _ = _silent(shop, (-1.0, 99.0), seconds=8.0)
    [found] = report
    assert found.severity == "warning" and "recorder" in found.advice
    report, _ = _silent(shop, (2.0, 99.0), seconds=8.0)
    assert [f.severity for f in report] == ["critical"]


def test_a_silence_that_is_over_within_a_beat_is_told_with_its_own_times(shop: Shop) -> None:
    report, begin = _silent(shop, (4.0, 4.2))
    [found] = report
    assert found.onset_s - begin == pytest.approx(4.0, abs=0.02)
    first, last = found.text.split("stamp ")[1].split(" s,")[0].split(" s to ")
    assert float(last) > float(first)


@pytest.mark.parametrize("both", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_sensor_that_clips_is_told_as_that_and_not_as_well(shop: Shop, both: bool) -> None:
    """Between its limits it tells the current, for seconds, and nothing beyond them."""
    log = shop.log(seconds=25.0)
    current = log.joint("actual_current").copy()
    since, most = log.t - log.t[0] > 5.0, 0.6 * current[:, 2].max()
    least = -most if both else -np.inf
    current[since, 2] = np.clip(current[since, 2], least, most)
    [found] = diagnose(shop.fit, with_current(log, current))
    assert (found.kind, found.joint, found.severity) == ("sensor_fault", 2, "critical")
    assert "clips at" in found.text and "well" not in found.text
    assert abs(found.evidence["value_A"]) == most


def test_a_sensor_that_was_stuck_and_tells_more_since_is_well(shop: Shop) -> None:
    log = shop.log(seconds=20.0)
    current = log.joint("actual_current").copy()
    begin, end = np.searchsorted(log.t - log.t[0], [5.0, 7.0])
    current[begin:end, 2] = current[begin, 2]
    [found] = diagnose(shop.fit, with_current(log, current))
    assert found.severity == "warning" and "was stuck" in found.text
    assert found.onset_s == pytest.approx(log.t[begin], abs=0.02)


def test_a_loop_that_rang_for_long_and_is_silent_leaves_no_noisy_sensor(shop: Shop) -> None:
    """As long as it rang, its current was rough; nobody adds that up for when it is over."""
    log = shop.log(seconds=26.0)
    age = log.t - log.t[0] - 4.0
    swing = 6.0 * np.sin(2.0 * np.pi * 19.4 * age) * ((age > 0.0) & (age < 9.0))
    found = shop.disturbed(log, 4, swing)
    assert [(f.kind, f.joint) for f in found] == [("controller_instability", 4)]


def _rows(t: float, current: np.ndarray, asked: np.ndarray | float, speed: float = 0.5) -> Rows:
    """A beat of a quarter of a second at these currents, (25, J) [A], of which `asked` was."""
    n, J = current.shape
    z = np.zeros((n, J))
    return Rows(
        t=t + 0.01 * np.arange(n),
        q=z,
        v=z + speed,
        load=z + 1.0,
        current=current,
        predicted=z + asked,
        tool=np.zeros((n, J, 10)),
        rigid=np.zeros((n, J, 1)),
        drive=np.zeros((n, 6, J)),
        doubt=z,
        settled=z == 0.0,
        warm=np.zeros((n, 3, J)),
        shift=z,
    )


def _noisy(shop: Shop, seconds: float) -> float:
    """[s] for which a current sensor is disbelieved after it was noisy for so long."""
    sensors = Diagnosis(shop.fit, 0.01).fast.sensors
    rng, J, noise, state, t = np.random.default_rng(0), 6, shop.fit.noise.sd, sensors.init(), 0.0
    for beat in range(40 * round(seconds)):
        times = np.where(np.arange(J) == 2, 8.0 if t < seconds else 1.0, 1.0)
        rows = _rows(t, 1.0 + noise * times * rng.standard_normal((25, J)), 1.0)
        state, _, untrue = sensors.step(state, rows, sensors.torn(rows), np.zeros(J, dtype=bool))
        assert untrue[2] or t < 2.0 or t > seconds, beat
        if t > seconds and not untrue[2]:
            return t - seconds
        t += 0.25
    return float("inf")


def test_a_noisy_sensor_s_size_is_the_noise_that_it_should_not_have(shop: Shop) -> None:
    """Of Coulomb friction; its usual noise, and what it has besides, add as squares."""
    health, drive = shop.diagnosis(shop.log(seconds=1.0)).fast.sensors, shop.fit.dynamics.drive
    loud = replace(health.init(), rough=np.sqrt(1.0 + 0.5**2) * health.usual)
    event = health._noisy(loud, 2, 1.0)
    torque = 0.5 * health.usual * drive.gain
    assert event.size == pytest.approx((torque / drive.coulomb)[2], rel=1e-9)


def test_a_sensor_is_believed_again_as_soon_however_long_it_was_noisy(shop: Shop) -> None:
    """Its last noisy beats fade for as long as one has to be noisy, then it shows no sign of it."""
    assert _noisy(shop, 10.0) == _noisy(shop, 120.0) < 2.0 * BELIEVED + 1.0


def test_a_sensor_that_is_no_longer_noisy_was_so_until_then(shop: Shop) -> None:
    fault = "sensor_fault:joint=1,mode=noisy,size=2,onset=3,duration=6"
    [found] = shop.report(fault, seconds=16.0)
    assert (found.severity, "was noisy from" in found.text) == ("warning", True)
    begin = found.onset_s - 3.0
    assert found.evidence["until_s"] - begin == pytest.approx(9.0, abs=0.5)


def test_a_value_that_is_off_is_seen_in_any_row_of_a_beat() -> None:
    for rows in (10, 25, 31):
        for row in range(rows):
            left = np.zeros((rows, 2))
            left[row, 1] = 40.0
            np.testing.assert_array_equal(sensor_signs.off(left), left > 0.0)
    assert not sensor_signs.off(np.full((4, 2), 40.0)).any()


@pytest.mark.parametrize("frequency", np.linspace(1.0, 49.0, 17))
def test_a_tone_of_any_pitch_is_no_louder_noise_than_it_is(frequency: float) -> None:
    """A motor that turns by 42 Hz made a sound joint's sensor three times as noisy as it was."""
    for phase in np.linspace(0.0, np.pi, 7):
        tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency * np.arange(240) / 100.0 + phase)
        most = 2.0 * MAD_TO_SD / sensor_signs.SECOND  # at a quarter of the rate
        assert sensor_signs.rough(np.ones(1), tone[:, None])[0] < 1.05 * most


@pytest.mark.parametrize(("dof", "keep"), [(100.0, 0.0), (4.5, 0.0), (4.5, 0.6), (8.0, -0.3)])
def test_noise_of_any_tails_and_colour_is_as_rough_as_it_is_usually(
    dof: float, keep: float
) -> None:
    """Its sd is half as much again where tails are heavy, and noise that grew hid below that."""
    w = np.random.default_rng(2).standard_t(dof, (20000, 1))
    noise = lfilter([1.0], [1.0, -keep], w, axis=0)
    covariance = keep ** np.arange(7)[:, None] * dof / (dof - 2.0) / (1.0 - keep**2)
    usual = sensor_signs.usually(covariance, np.array([dof]))
    assert sensor_signs.rough(usual, noise) == pytest.approx(usual, rel=0.1)


def test_noise_is_of_what_is_known_of_each_joint_however_little_that_is() -> None:
    """The law that it keeps: a median that leaves out what is unknown, of even counts and odd."""
    bent = np.abs(np.random.default_rng(5).standard_normal((47, 6)))
    for j in range(1, 6):
        bent[j::7, j] = bent[: 4 * j, j] = np.nan
    np.testing.assert_array_equal(sensor_signs._median(bent), np.nanmedian(bent, axis=0))


@pytest.mark.parametrize(("asked", "speed", "none"), [(5.0, 0.5, 2), (1.0, 0.5, 0), (5.0, 0.0, 0)])
def test_two_zeros_in_a_row_of_a_joint_that_slides_are_none(
    shop: Shop, asked: float, speed: float, none: int
) -> None:
    """One that is asked for as little may be chance, and so may any of a joint that rests."""
    sensors, current = Diagnosis(shop.fit, 0.01).fast.sensors, np.full((25, 6), asked)
    current = current * shop.fit.noise.sd
    asks = current.copy()
    current[[3, 10, 11], 2] = 0.0
    assert np.count_nonzero(sensors.torn(_rows(0.0, current, asks, speed))) == none


def test_a_sensor_that_drops_to_nothing_now_and_then_is_erratic_and_not_well_since(
    shop: Shop,
) -> None:
    """Whichever of its silences were long, and though its joint, as it rests, shows none."""
    sensors, rng = Diagnosis(shop.fit, 0.01).fast.sensors, np.random.default_rng(4)
    state, told, no = sensors.init(), list[Event](), np.zeros(6, dtype=bool)
    asked = 5.0 * shop.fit.noise.sd
    for beat in range(60):
        t, silent = 0.25 * beat, 18 if beat == 20 else 5
        current = asked + shop.fit.noise.sd * rng.standard_normal((25, 6))
        current[4 : 4 + silent, 2] = 0.0
        rows = _rows(t, current, asked, 0.5 if beat < 48 else 0.0)
        torn = sensors.torn(rows)
        heard = replace(rows, current=np.where(torn, np.nan, rows.current))
        state, events, _ = sensors.step(state, heard, torn, no)
        told += events
    told += sensors.well(state, t, BELIEVED)[1]
    assert [event.evidence["mode"] for event in told] == ["erratic"]


def test_a_biased_sensor_that_gets_stuck_is_told_as_both(shop: Shop) -> None:
    of = "sensor_fault:joint=4,mode="
    report = shop.report(
        of + "biased,size=2,onset=15", of + "stuck,onset=40", seconds=50.0, rate=25.0
    )
    sensors = [finding for finding in report if finding.kind == "sensor_fault"]
    biased, stuck = sorted(sensors, key=lambda f: f.onset_s)
    assert biased.joint == stuck.joint == 4
    assert "bias of the current" in biased.text
    assert stuck.evidence["mode"] == "stuck" and "stuck" in stuck.text
