"""One story a kind: a fault goes in, one finding comes out, with the right name and joint."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from realarm import with_current
from shop import Shop

from urdyn.diagnose import Report, diagnose
from urdyn.diagnose.state import Now
from urdyn.signal import Causal, samples

SLOW, QUICK = 25.0, 100.0  # [Hz] what blocks of seconds tell needs no more
STIFF = "friction_increase:joint=2,onset=25,rate=0.6,shape=step"
WEAK = "health_degradation:joint=1,onset=25,rate=0.2,shape=step"

STORIES = {
    "collision": ("collision:link=4,force=90/0/60,onset=12", 15.0, QUICK, 4, 1.0),
    "stuck": ("sensor_fault:joint=3,mode=stuck,onset=10", 15.0, QUICK, 3, 0.5),
    "noisy": ("sensor_fault:joint=1,mode=noisy,size=3,onset=10", 15.0, QUICK, 1, 2.0),
    "payload_change": ("payload_change:onset=12,mass=1.5", 40.0, SLOW, None, 25.0),
    "friction_increase": (STIFF, 60.0, SLOW, 2, 30.0),
    "health": (WEAK, 60.0, SLOW, 1, 30.0),
}


@cache
def told(shop: Shop, fault: str, seconds: float, rate: float) -> Report:
    """What is told of a fault, whoever asks."""
    return shop.report(fault, seconds=seconds, rate=rate)


@pytest.mark.parametrize("story", STORIES)
def test_one_fault_is_one_finding_of_its_kind_and_joint(shop: Shop, story: str) -> None:
    fault, seconds, rate, joint, patience = STORIES[story]
    kind, onset = fault.partition(":")[0], float(fault.partition("onset=")[2].partition(",")[0])
    found = told(shop, fault, seconds, rate)
    assert [(f.kind, f.joint) for f in found] == [(kind, joint)]
    (finding,) = found
    lo, hi = finding.onset_interval_s
    assert lo <= onset <= hi and hi - lo < 20.0
    assert finding.alarm_s < onset + patience
    assert finding.confidence > 0.5


@pytest.mark.parametrize("joint", [pytest.param(1, marks=pytest.mark.slow), 5])
def test_a_sensor_that_drifts_is_told_as_one_and_since_when(shop: Shop, joint: int) -> None:
    """Its bias grows; as a step it would have begun later."""
    log = shop.log(seconds=45.0, rate=SLOW)
    begin, rate = 15.0, 0.06  # [s], Coulomb frictions [1/s]
    gone = np.maximum(log.t - log.t[0] - begin, 0.0)
    report = shop.disturbed(log, joint, rate * gone * shop.dynamics.drive.coulomb[joint])
    (finding,) = report.findings
    assert (finding.kind, finding.joint) == ("sensor_fault", joint)
    earliest, latest = finding.onset_interval_s
    assert earliest <= log.t[0] + begin <= latest
    # It is known up to its last block, of the middle of which its mean tells.
    known = finding.evidence["series"]["t"][-1] - log.t[0] - begin
    assert abs(finding.size - rate * known) < rate * 5.0


def test_a_noisy_sensor_is_told_at_twenty_samples_a_second_too(shop: Shop) -> None:
    log = shop.log(seconds=20.0, rate=20.0)
    noise = 5.0 * shop.fit.noise.sd[3] * shop.dynamics.drive.gain[3]
    rough = noise * np.random.default_rng(1).standard_normal(len(log.t))
    [found] = shop.disturbed(log, 3, np.where(log.t > 10.0, rough, 0.0))
    assert (found.kind, found.joint) == ("sensor_fault", 3) and found.alarm_s < 16.0
    lo, hi = found.onset_interval_s
    assert lo <= 10.0 <= hi


@pytest.mark.parametrize(
    "lost", [0.2, *(pytest.param(lost, marks=pytest.mark.slow) for lost in (0.1, 0.4))]
)
def test_what_a_drive_lost_is_told_as_that(shop: Shop, lost: float) -> None:
    """Its current grows by more: by a quarter where a fifth is lost."""
    fault = f"health_degradation:joint=1,onset=25,rate={lost},shape=step"
    (finding,) = (f for f in told(shop, fault, 60.0, SLOW) if f.kind == "health_degradation")
    assert abs(finding.size + lost) < 3.0 * finding.size_sd < 0.05


def test_what_wore_before_the_run_is_found_and_said_to_be_older(shop: Shop) -> None:
    """A half more than when it was commissioned: eight times what days do."""
    wear = "friction_increase:joint=2,onset=0,rate=0.5,viscous=0.5,shape=step"
    log = shop.log(wear, seconds=30.0, rate=SLOW)
    (finding,) = diagnose(shop.fit, log)
    assert (finding.kind, finding.joint, finding.older) == ("friction_increase", 2, True)
    more = shop.grown(log, 2, 0.5, 0.5, 0.0)  # all but what grows with the load
    assert 0.4 < more < 0.5 and abs(finding.size - more) < 3.0 * finding.size_sd < 0.25
    by = finding.onset_interval_s[1]
    assert by < log.t[0] + 15.0 and f"since stamp {by:.1f} s or before" in finding.text


@pytest.mark.parametrize(
    "joint", [2, *(pytest.param(joint, marks=pytest.mark.slow) for joint in (0, 1, 4))]
)
def test_all_friction_is_told_to_grow_by_what_it_does_whichever_term_that_is(
    shop: Shop, joint: int
) -> None:
    """The teeth's alone by a half; terms are told apart beside it, and less surely."""
    wear = f"friction_increase:joint={joint},onset=25,rate=0.6,shape=step"
    (finding,) = told(shop, wear, 60.0, SLOW)
    more = shop.grown(shop.log(wear, seconds=60.0, rate=SLOW), joint, 0.6, 0.0, 25.0)
    assert 0.1 < more < 0.5 and abs(finding.size - more) < 3.0 * finding.size_sd < 0.25
    coulomb = finding.evidence["terms"]["coulomb"]
    assert abs(coulomb["size"] - 0.6) < 3.0 * coulomb["sd"] and coulomb["sd"] > finding.size_sd


@pytest.mark.parametrize(
    ("joint", "rate"),
    [(2, SLOW), *(pytest.param(joint, QUICK, marks=pytest.mark.slow) for joint in (0, 4))],
)
def test_what_grows_with_the_speed_alone_is_viscous_friction(
    shop: Shop, joint: int, rate: float
) -> None:
    """Coulomb friction is what it was; of them all there is so much more."""
    wear = f"friction_increase:joint={joint},onset=25,rate=0,viscous=0.7,shape=step"
    log = shop.log(wear, seconds=60.0, rate=rate)
    (finding,) = diagnose(shop.fit, log)
    assert (finding.kind, finding.joint) == ("friction_increase", joint)
    assert finding.quantity == "friction by its viscous part"
    more = shop.grown(log, joint, 0.0, 0.7, 25.0)
    assert 0.1 < more < 0.4 and abs(finding.size - more) < 3.0 * finding.size_sd < 0.25
    viscous = finding.evidence["terms"]["viscous"]
    assert abs(viscous["size"] - 0.7) < 3.0 * viscous["sd"] < 0.7  # it is surely there


@pytest.mark.parametrize(
    "viscous", [0.01, *(pytest.param(rate, marks=pytest.mark.slow) for rate in (0.005, 0.02))]
)
def test_friction_that_grows_as_a_whole_is_one_finding(shop: Shop, viscous: float) -> None:
    wear = f"friction_increase:joint=2,onset=20,rate=0.01,viscous={viscous}"
    (finding,) = shop.report(wear, seconds=90.0, rate=SLOW)
    assert (finding.kind, finding.joint) == ("friction_increase", 2)
    assert finding.quantity == "friction" and finding.severity != "notice"


def test_a_day_on_which_friction_is_a_tenth_higher_is_a_day(shop: Shop) -> None:
    assert not shop.report(
        "friction_increase:joint=2,onset=0,rate=0.1,shape=step", seconds=30.0, rate=SLOW
    )


def test_a_payload_is_told_with_its_mass(shop: Shop) -> None:
    (finding,) = told(shop, *STORIES["payload_change"][:3])
    assert abs(finding.evidence["mass_kg"] - 1.5) < 0.15


@pytest.mark.parametrize(
    "seconds", [26.0, *(pytest.param(s, marks=pytest.mark.slow) for s in (23.0, 30.0))]
)
def test_a_load_that_is_there_when_a_recording_ends_is_told(shop: Shop, seconds: float) -> None:
    (finding,) = shop.report("payload_change:onset=12,mass=1.5", seconds=seconds, rate=SLOW)
    assert finding.kind == "payload_change" and not finding.older
    assert abs(finding.size - 1.5) < 2.0 * finding.size_sd < 0.4
    lo, hi = finding.onset_interval_s
    assert lo <= 12.0 <= hi


def test_a_piece_that_an_arm_holds_when_a_recording_ends_is_work(shop: Shop) -> None:
    """Two of its kind were put down before."""
    grips = zip((3.0, 7.0, 10.0, 14.0, 17.0), (1.5, 0.0, 1.5, 0.0, 1.5), strict=True)  # [s], [kg]
    pieces = [f"payload_change:onset={t},mass={m}" for t, m in grips]
    assert not len(shop.report(*pieces, seconds=29.0, rate=SLOW))


def test_a_push_is_told_with_its_force(shop: Shop) -> None:
    (finding,) = told(shop, *STORIES["collision"][:3])
    assert abs(np.linalg.norm(finding.evidence["force_N"]) - np.hypot(90.0, 60.0)) < 45.0


@pytest.mark.parametrize(("motion", "seconds"), [("fourier", 40.0), ("pick_and_place", 20.0)])
def test_a_healthy_arm_raises_nothing(shop: Shop, motion: str, seconds: float) -> None:
    assert len(shop.report(seconds=seconds, rate=QUICK, motion=motion)) == 0


def test_a_ringing_joint_is_told_with_its_frequency(shop: Shop) -> None:
    fault = "controller_instability:joint=1,onset=4,rate=1.6,shape=step"
    found = shop.report(fault, seconds=8.0, rate=500.0)
    assert [(f.kind, f.joint) for f in found] == [("controller_instability", 1)]
    assert abs(found.findings[0].evidence["frequency_Hz"] - 8.0) < 0.5
    assert found.findings[0].alarm_s < 4.0 + 1.25


@pytest.mark.parametrize(
    ("joint", "frequency"),
    [(2, 11.8), *(pytest.param(*of, marks=pytest.mark.slow) for of in ((3, 9.3), (5, 21.0)))],
)
def test_a_newton_metre_that_rings_is_told_in_time(
    shop: Shop, joint: int, frequency: float
) -> None:
    log, onset = shop.log(seconds=12.0, rate=500.0), 8.1
    since = log.t - log.t[0] - onset
    swing = np.sin(2.0 * np.pi * frequency * since)
    report = shop.disturbed(log, joint, np.where(since > 0.0, swing, 0.0))
    assert [(f.kind, f.joint) for f in report] == [("controller_instability", joint)]
    assert report.findings[0].alarm_s - log.t[0] < onset + 1.2
    assert abs(report.findings[0].evidence["amplitude_Nm"] - 1.0) < 0.3


@pytest.mark.parametrize(
    ("joint", "motion"),
    [
        (5, "fourier"),
        (4, "pick_and_place"),
        *(pytest.param(j, "fourier", marks=pytest.mark.slow) for j in range(5)),
        pytest.param(0, "pick_and_place", marks=pytest.mark.slow),
    ],
)
def test_an_encoder_that_jumps_is_told_at_once(shop: Shop, joint: int, motion: str) -> None:
    """Of joints that carry nothing, too, and before it moves what currents would tell."""
    fault = f"encoder_offset:joint={joint},offset=0.02,onset=8"
    (finding,) = shop.report(fault, seconds=12.0, rate=QUICK, motion=motion)
    assert (finding.kind, finding.joint, finding.severity) == ("encoder_offset", joint, "critical")
    assert abs(finding.size + 0.02) < 1e-3
    assert abs(finding.onset_s - 8.0) < 0.02
    assert finding.alarm_s < 8.0 + 0.3


@pytest.mark.parametrize("offset", [pytest.param(0.02, marks=pytest.mark.slow), 0.004])
def test_live_an_encoder_that_jumps_is_told_at_once(shop: Shop, offset: float) -> None:
    log = shop.log(f"encoder_offset:joint=4,offset={offset},onset=8", seconds=10.0, rate=QUICK)
    diagnosis, causal = shop.diagnosis(log), Causal(0.01)
    window, state, found = causal.init(6), diagnosis.init(), []
    motion, s, moved = shop.motion(log)
    for sample in samples(log):
        window, instant = causal.step(window, sample)
        if instant is not None:
            k = int(np.searchsorted(motion.t, instant.t))
            state, new = diagnosis.step(state, Now(instant, s[k], moved[k]))
            found += new
    assert [(f.kind, f.joint) for f in found] == [("encoder_offset", 4)]
    assert abs(found[0].size + offset) < 0.05 * offset
    assert found[0].alarm_s < 8.0 + 0.3


def test_a_zero_that_jumps_again_is_told_by_what_it_is_off_in_all(shop: Shop) -> None:
    twice = (
        "encoder_offset:joint=4,offset=0.02,onset=6",
        "encoder_offset:joint=4,offset=0.01,onset=9",
    )
    (finding,) = shop.report(*twice, seconds=12.0)
    assert abs(finding.size + 0.03) < 1e-3
    assert abs(finding.onset_s - 6.0) < 0.02


@pytest.mark.parametrize("back", [6.08, pytest.param(6.2, marks=pytest.mark.slow), 9.0])
def test_a_zero_that_is_right_again_is_a_loose_contact(shop: Shop, back: float) -> None:
    """Within a beat, too, and within what a jump shakes."""
    there = "encoder_offset:joint=4,offset=0.02,onset=6"
    (finding,) = shop.report(
        there, f"encoder_offset:joint=4,offset=-0.02,onset={back}", seconds=back + 3.0, rate=QUICK
    )
    assert (finding.kind, finding.joint, finding.severity) == ("encoder_offset", 4, "warning")
    assert (finding.size, finding.evidence["until_s"]) == (0.0, pytest.approx(back, abs=0.02))
    assert abs(finding.onset_s - 6.0) < 0.02
    assert "loose contact" in finding.advice


@pytest.mark.parametrize(
    ("lasting", "seconds", "joints"),
    [(10.0, 75.0, []), pytest.param(60.0, 105.0, [1], marks=pytest.mark.slow)],
)
def test_what_the_next_blocks_take_back_was_no_fault(
    shop: Shop, lasting: float, seconds: float, joints: list[int]
) -> None:
    """A joint rubs for two blocks, as a piece that nobody knew of makes it seem to; or for long."""
    j, onset, log = 1, 35.0, shop.log(seconds=seconds, rate=SLOW)
    since = log.t - log.t[0] - onset
    rubs = (since > 0.0) & (since < lasting)
    friction = 0.4 * shop.dynamics.drive.coulomb[j] * np.sign(log.joint("actual_qd")[:, j])
    report = shop.disturbed(log, j, rubs * friction)
    assert [f.joint for f in report] == joints
    assert all(f.kind == "friction_increase" for f in report)


@pytest.mark.slow
def test_the_end_of_a_passing_fault_is_no_other_fault(shop: Shop) -> None:
    """A wrist rubs for 25 s and is sound again: its current falls to what it was at first."""
    j, drive, log = 4, shop.dynamics.drive, shop.log(seconds=55.0, rate=SLOW)
    since, v = log.t - log.t[0] - 12.0, log.joint("actual_qd")[:, 4]
    rubs = (since > 0.0) & (since < 25.0)
    friction = drive.coulomb[j] * np.tanh(v / 0.01) + drive.viscous[j] * v
    report = shop.disturbed(log, j, rubs * 0.6 * friction)
    assert {f.kind for f in report} <= {"friction_increase"}


@pytest.mark.slow
def test_two_faults_at_once_are_two_findings(shop: Shop) -> None:
    faults = (
        "friction_increase:joint=3,onset=25,rate=0.8,shape=step",
        "health_degradation:joint=1,onset=25,rate=0.2,shape=step",
    )
    told = {(f.kind, f.joint) for f in shop.report(*faults, seconds=100.0, rate=QUICK)}
    assert told == {("friction_increase", 3), ("health_degradation", 1)}


def test_backlash_under_gravity_is_said_to_be_out_of_sight(shop: Shop) -> None:
    report = shop.report(seconds=4.0)
    rows = report.document["observability"]["joint_backlash"]
    assert len(rows) == 6
    for row in rows:
        assert row["observable"] or "not observable" in row["why"]


def test_a_recording_that_ends_while_a_name_is_unclear_has_the_name_that_there_is(shop) -> None:
    """A hand's drive that gives less, or whose friction rose: in half a minute nobody can tell."""
    report = shop.report(
        "health_degradation:joint=5,onset=25,rate=0.15,shape=step", seconds=44, rate=QUICK, seed=6
    )
    (finding,) = report.findings
    assert (finding.kind, finding.joint) == ("health_degradation", 5)
    assert finding.alarm_s > 40.0 and finding.confidence < 0.95
    assert finding.evidence["rivals"][0]["kind"] == "friction_increase"


def test_what_was_repaired_is_not_told_again_a_minute_later(shop) -> None:
    fault, how = "friction_increase:joint=1,onset=15,rate=0.5,shape=step", {"rate": SLOW}
    sound, worn = shop.log(seconds=100.0, **how), shop.log(fault, seconds=100.0, **how)
    t = sound.t - sound.t[0]
    sick = ((t > 15.0) & (t < 48.0))[:, None]
    current = np.where(sick, *(log.joint("actual_current") for log in (worn, sound)))
    assert not diagnose(shop.fit, with_current(sound, current)).findings
    lasted = np.where(
        (t > 15.0)[:, None] & (t < 75.0)[:, None],
        worn.joint("actual_current"),
        sound.joint("actual_current"),
    )
    (told,) = diagnose(shop.fit, with_current(sound, lasted)).findings
    assert (told.kind, told.joint) == ("friction_increase", 1)
    assert told.gone and told.text.endswith("gone by now") and "repaired" in told.advice
