"""Laws of faults: each changes what it should, as it should, and nothing before its onset."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.model.arm import Arm
from urdyn.model.dynamics import Dynamics
from urdyn.simulate import (
    KINDS,
    Course,
    Payload,
    course,
    fourier,
    observe,
    parse_fault,
    perfect_sensors,
    typical_sensors,
    virtual_arm,
    write_truth,
)
from urdyn.simulate.faults import describe
from urdyn.simulate.follow import follow
from urdyn.simulate.schedule import without_events
from urdyn.simulate.unfolding import unfolding
from urdyn.simulate.wear import LEAST_HEALTH
from urdyn.types import Log

ONSET = 4.0  # [s]
T = np.linspace(0.0, 12.0, 241)
J = 2

# A fault -> the parts of the course that it may touch, the channels that then differ, and whether
# those of other joints may differ too.
KIND = {
    "friction_increase:joint=2,rate=0.1": ({"coulomb"}, {"actual_current"}, False),
    "friction_increase:joint=2,rate=0.1,viscous=0.2": (
        {"coulomb", "viscous"},
        {"actual_current"},
        False,
    ),
    "friction_increase:joint=2,rate=0.3,shape=step": ({"coulomb"}, {"actual_current"}, False),
    "friction_increase:joint=2,rate=0.1,shape=exponential": (
        {"coulomb"},
        {"actual_current"},
        False,
    ),
    "health_degradation:joint=2,rate=0.05": ({"health"}, {"actual_current"}, False),
    "joint_backlash:joint=2,rate=0.001": ({"half_gap"}, {"actual_current"}, False),
    "controller_instability:joint=2,rate=0.5": (
        {"loop_gain"},
        {"actual_q", "actual_qd", "actual_current", "actual_TCP_pose", "ft_raw_wrench"},
        True,
    ),
    "controller_instability:joint=2,delay=0.002": (
        {"loop_delay"},
        {"actual_q", "actual_qd", "actual_current", "actual_TCP_pose", "ft_raw_wrench"},
        True,
    ),
    "payload_change:mass=1.5": (
        {"payload"},
        {"actual_current", "actual_TCP_force", "ft_raw_wrench"},
        True,
    ),
    "collision:link=5,force=0/40/-60": (
        {"push"},
        {"actual_current", "actual_TCP_force", "ft_raw_wrench"},
        True,
    ),
    "encoder_offset:joint=2,offset=0.01": (
        {"encoder_offset"},
        {"actual_q", "actual_TCP_pose"},
        False,
    ),
    "encoder_offset:joint=2,rate=0.001": (
        {"encoder_offset"},
        {"actual_q", "actual_TCP_pose"},
        False,
    ),
    "sensor_fault:joint=2,mode=stuck": ({"sensor_stuck"}, {"actual_current"}, False),
    "sensor_fault:joint=2,mode=biased,size=2": ({"sensor_bias"}, {"actual_current"}, False),
    "sensor_fault:joint=2,mode=noisy,size=2": ({"sensor_noise"}, {"actual_current"}, False),
    "sensor_fault:joint=2,mode=dropped": ({"sensor_dropped"}, {"actual_current"}, False),
    "thermal_drift:rate=0.1": ({"ambient"}, set(), False),
}


def fault(text: str, onset: float = ONSET):
    return parse_fault(f"{text},onset={onset}", 6)


@pytest.fixture(scope="module")
def dynamics(ur5e: Arm) -> Dynamics:
    return virtual_arm(ur5e, 6, Payload(0.8, np.array([0.0, 0.0, 0.06])))


@pytest.fixture(scope="module")
def made(ur5e: Arm):
    return fourier(ur5e, 12.0, 125.0, np.random.default_rng(1))


@pytest.fixture(scope="module")
def logs(ur5e: Arm, dynamics: Dynamics, made):
    """The log of an arm, noise and wrench included, that some faults befall."""
    sensors = replace(typical_sensors(ur5e), wrench_noise=(0.1, 0.01))

    def log(*texts: str) -> Log:
        events = tuple(fault(text) for text in texts)
        return observe(dynamics, made, sensors, np.random.default_rng(3), events)

    return log


def unlike(one: Course, other: Course) -> set[str]:
    return {
        field.name
        for field in fields(Course)
        if not np.array_equal(getattr(one, field.name), getattr(other, field.name))
    }


def test_every_kind_is_tried():
    assert {text.partition(":")[0] for text in KIND} == set(KINDS)


@pytest.mark.parametrize("text", KIND)
def test_a_fault_changes_its_part_of_the_course_and_no_other(dynamics, text):
    touched, _, _ = KIND[text]
    assert unlike(course(dynamics, (fault(text),), T), without_events(dynamics, T)) == touched


@pytest.mark.parametrize("text", KIND)
def test_a_fault_shows_in_its_channels_after_its_onset_alone(logs, text):
    healthy, sick = logs(), logs(text)
    _, shown, everywhere = KIND[text]
    before = healthy.t < ONSET
    for name, values in healthy.channels.items():
        told = sick.channels[name]
        np.testing.assert_array_equal(told[before], values[before], err_msg=name)
        same = np.isclose(told, values, rtol=0, atol=0, equal_nan=True)
        assert same.all() == (name not in shown), name
        if name in ("actual_q", "actual_qd", "actual_current") and not everywhere:
            assert np.delete(same, J, axis=1).all(), name


def test_nothing_on_schedule_is_the_equation_bit_for_bit(dynamics, made):
    (part,) = follow(dynamics, made, made.t)
    motion = replace(made.at(made.t), temperature=part.course.temperature)
    drive = dynamics.drive
    amperes = dynamics.torque(motion) / (drive.gain * drive.health)
    np.testing.assert_array_equal(part.current, amperes)


def test_friction_grows_by_equation_5(dynamics):
    rate, since = 0.02, np.maximum(T - ONSET, 0.0)
    f0 = dynamics.drive.coulomb[J]
    f = f0 * course(dynamics, (fault(f"friction_increase:joint=2,rate={rate}"),), T).coulomb[:, J]
    np.testing.assert_allclose(f, f0 + rate * f0 * since, rtol=1e-14)


def test_health_falls_by_equation_6_down_to_its_floor(dynamics):
    now = course(dynamics, (fault("health_degradation:joint=2,rate=0.15"),), T)
    z = dynamics.drive.health[J] - 0.15 * np.maximum(T - ONSET, 0.0)
    assert z.min() < 0.0
    np.testing.assert_allclose(now.health[:, J], np.maximum(z, LEAST_HEALTH), rtol=1e-14)


@pytest.mark.parametrize(
    ("shape", "grown"),
    [
        ("linear", lambda s: 0.1 * s),
        ("step", lambda s: 0.1 + 0 * s),
        ("exponential", lambda s: np.expm1(0.1 * s)),
    ],
)
def test_shapes_of_growth(dynamics, shape, grown):
    now = course(dynamics, (fault(f"friction_increase:joint=2,rate=0.1,shape={shape}"),), T)
    after = T >= ONSET
    wanted = 1.0 + grown(T[after] - ONSET)
    np.testing.assert_allclose(now.coulomb[after, J], wanted, rtol=1e-14)


def test_the_current_of_a_rise_in_friction_is_linear_in_it(dynamics, made):
    text = "friction_increase:joint=2,rate=0.05"
    (healthy,), (sick,) = (follow(dynamics, made, made.t, e) for e in ((), (fault(text),)))
    s = dynamics.presliding(healthy.motion)[:, J]
    rise = dynamics.drive.coulomb[J] * 0.05 * np.maximum(made.t - ONSET, 0.0) * s
    wanted = rise / (dynamics.drive.gain[J] * dynamics.drive.health[J])
    got = sick.current[:, J] - healthy.current[:, J]
    np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-13 * np.abs(healthy.current).max())


def test_half_the_health_takes_twice_the_current(dynamics, made):
    texts = ("health_degradation:joint=2,rate=0.5,shape=step",)
    (healthy,), (sick,) = (
        follow(dynamics, made, made.t, e) for e in ((), tuple(fault(t, 0.0) for t in texts))
    )
    np.testing.assert_allclose(sick.current[:, J], 2.0 * healthy.current[:, J], rtol=1e-13)


def test_several_faults_commute(dynamics):
    rng = np.random.default_rng(0)
    events = [fault(text) for text in KIND]
    one = course(dynamics, events, T)
    for _ in range(5):
        other = course(dynamics, [events[k] for k in rng.permutation(len(events))], T)
        for field in fields(Course):
            got, wanted = getattr(other, field.name), getattr(one, field.name)
            np.testing.assert_allclose(got, wanted, rtol=1e-14, err_msg=field.name)


def test_of_two_payloads_the_later_stays(dynamics):
    early, late = fault("payload_change:mass=1", 2.0), fault("payload_change:mass=2", 6.0)
    for events in ((early, late), (late, early)):
        mass = course(dynamics, events, np.array([0.0, 2.0, 6.0])).payload[:, 0]
        assert mass.tolist() == [0.8, 1.0, 2.0]


def test_a_push_is_felt_by_the_joints_below_it_as_virtual_work_says(ur5e, dynamics, made):
    push = fault("collision:link=3,force=10/-20/30,duration=1")
    (free,), (pushed,) = (follow(dynamics, made, made.t, e) for e in ((), (push,)))
    row = int(np.searchsorted(made.t, ONSET + 0.3))
    # The controller's base looks the other way than the root of the description.
    F = np.sin(np.pi * (made.t[row] - ONSET)) * np.array([-10.0, 20.0, 30.0])
    gained = pushed.load[row] - free.load[row]
    step = 1e-6
    for j in range(6):
        moved = [
            ur5e.pose(made.q[row] + h * np.eye(6)[j], end)[:3, 3]
            for h in (step, -step)
            for end in ("wrist_1_link", "wrist_2_link")  # it is pushed midway
        ]
        work = F @ (moved[0] + moved[1] - moved[2] - moved[3]) / (4.0 * step)
        assert gained[j] == pytest.approx(-work, abs=1e-6)
    assert gained[4:] == pytest.approx(0.0, abs=1e-12) and np.abs(gained[:3]).min() > 0.1


def test_a_gap_shows_where_the_load_turns_over_and_takes_the_load_away(dynamics, made):
    (tight,), (loose,) = (
        follow(dynamics, made, made.t, e)
        for e in ((), (fault("joint_backlash:joint=0,rate=0.001,shape=step", 0.0),))
    )
    drive = dynamics.drive
    gap = np.flatnonzero(tight.current[:, 0] != loose.current[:, 0])
    crossing = np.sqrt(4.0 * 0.001 * drive.rotor_inertia[0] / drive.coulomb[0])
    turns = made.t[1:][np.diff(np.sign(tight.load[:, 0])) != 0]
    since = made.t[gap] - turns[np.searchsorted(turns, made.t[gap], side="right") - 1]
    assert len(gap) and since.min() >= 0.0 and since.max() < crossing
    unloaded = (loose.current - tight.current)[gap, 0] * drive.gain[0]
    s = dynamics.presliding(tight.motion)[gap, 0]
    load = tight.load[gap, 0]
    np.testing.assert_allclose(
        unloaded, -load - drive.structural[0] * np.abs(load) * s, rtol=0, atol=1e-12
    )


def test_gravity_hides_a_gap(ur5e, dynamics):
    held = fourier(ur5e, 4.0, 125.0, np.random.default_rng(0))
    still = replace(held, q=np.tile([0, -0.5, 0, 0, 0, 0.0], (500, 1)), v=0 * held.v, a=0 * held.a)
    gap = fault("joint_backlash:joint=1,rate=0.01", 0.0)
    (tight,), (loose,) = (follow(dynamics, still, still.t, e) for e in ((), (gap,)))
    np.testing.assert_array_equal(tight.current, loose.current)


def test_a_loop_rings_only_past_its_margin_and_wider_with_time(ur5e, dynamics, made):
    ill = fault("controller_instability:joint=2,rate=0.5", 0.0)  # the margin of 2 is used up at 2 s
    log = observe(dynamics, made, perfect_sensors(ur5e), np.random.default_rng(0), (ill,))
    swing = np.abs(log.channels["actual_q"] - log.channels["target_q"])[:, J]
    assert not swing[log.t < 2.0].any()
    tops = [swing[(log.t >= a) & (log.t < a + 2.0)].max() for a in (2.0, 4.0, 6.0, 8.0)]
    assert tops == sorted(tops) and tops[0] > 0.0


def test_a_stuck_sensor_tells_its_last_value_and_recovers(ur5e, dynamics, made):
    ill = fault("sensor_fault:joint=2,mode=stuck,duration=2")
    log = observe(dynamics, made, perfect_sensors(ur5e), np.random.default_rng(0), (ill,))
    well = observe(dynamics, made, perfect_sensors(ur5e), np.random.default_rng(0))
    current, true = (x.channels["actual_current"][:, J] for x in (log, well))
    held = (log.t >= ONSET) & (log.t < ONSET + 2.0)
    assert set(current[held]) == {true[np.flatnonzero(held)[0] - 1]}
    np.testing.assert_array_equal(current[~held], true[~held])


def test_a_noisy_sensor_has_the_noise_asked_for(ur5e, dynamics, made):
    ill = fault("sensor_fault:joint=2,mode=noisy,size=2")
    log = observe(dynamics, made, perfect_sensors(ur5e), np.random.default_rng(0), (ill,))
    well = observe(dynamics, made, perfect_sensors(ur5e), np.random.default_rng(0))
    noise = (log.channels["actual_current"] - well.channels["actual_current"])[log.t >= ONSET, J]
    assert (noise**2).mean() == pytest.approx(4.0, rel=5.0 * np.sqrt(2.0 / len(noise)))


@pytest.mark.parametrize("text", KIND)
def test_a_fault_is_described_as_it_was_asked_for(text):
    table = describe(fault(text))
    kind = table.pop("kind")
    words = {
        name: "/".join(map(str, value)) if isinstance(value, tuple) else value
        for name, value in table.items()
    }
    spelt = f"{kind}:" + ",".join(f"{name}={value}" for name, value in words.items())
    assert parse_fault(spelt, 6) == fault(text)


BAD = {
    "rust:joint=1": r"no kind 'rust'; name one of friction_increase, health_degradation",
    "friction_increase": r"needs joint and rate",
    "friction_increase:joint=1,rat=1": r"no field 'rat'; write joint=\.\.\., rate=\.\.\.",
    "friction_increase:joint": r"no field 'joint'",
    "friction_increase:joint=1,joint=2": r"joint is given twice",
    "friction_increase:joint=6,rate=1": r"joint=6: joints count from 0 to 5",
    "friction_increase:joint=-1,rate=1": r"joints count from 0 to 5",
    "friction_increase:joint=elbow,rate=1": r"joint=elbow: is a whole number",
    "friction_increase:joint=1,rate=fast": r"rate=fast: is a number",
    "friction_increase:joint=1,rate=nan": r"rate=nan: is to be finite",
    "friction_increase:joint=1,rate=-1": r"rate=-1: is not to be negative",
    "friction_increase:joint=1,rate=1,onset=-5": r"onset=-5: is not to be negative",
    "friction_increase:joint=1,rate=1,shape=cubic": r"is one of linear, step, exponential",
    "joint_backlash:joint=1,rate=1,shape=exponential": r"is one of linear, step",
    "collision:link=7,force=1/2/3": r"links count from 0 to 5",
    "collision:link=1,force=100": r"force=100: is three numbers X/Y/Z",
    "collision:link=1,force=1/2/inf": r"is to be finite",
    "sensor_fault:joint=1,mode=asleep": r"is one of stuck, biased, noisy, dropped",
    "collision:link=1,force=1/2/3,duration=0": r"duration=0: is to be above 0",
    "collision:link=1,force=1/2/3,duration=inf": r"duration=inf: is to be finite",
    "sensor_fault:joint=1,mode=stuck,duration=-1": r"duration=-1: is to be above 0",
    "thermal_drift:rate=-1,rise=-inf": r"rise=-inf: is to be finite",
    "payload_change:mass=-1": r"mass=-1: is not to be negative",
}


@pytest.mark.parametrize("text", BAD)
def test_a_fault_that_cannot_be_is_refused(text):
    with pytest.raises(InputError, match=BAD[text]) as refused:
        parse_fault(text, 6)
    assert repr(text) in str(refused.value)


@pytest.mark.parametrize(
    "text",
    [
        "friction_increase:joint=2,rate=100,shape=exponential",
        "joint_backlash:joint=2,rate=1e308",
        "encoder_offset:joint=1,offset=-1e300",
        "collision:link=3,force=1e308/0/0,duration=5",
        "thermal_drift:rate=1e308",
    ],
)
def test_a_fault_beyond_anything_that_can_be_is_refused(dynamics, text):
    with pytest.raises(InputError, match="which no arm has"):
        course(dynamics, [fault(text)], T)


@pytest.mark.parametrize(
    ("mass", "com"), [(1e308, 0.0), (np.nan, 0.0), (1.0, 1e308), (1.0, -np.inf)]
)
def test_a_payload_beyond_anything_that_can_be_is_refused(dynamics, mass, com):
    with pytest.raises(InputError, match="cannot be carried"):
        Payload(mass, np.array([0.0, 0.0, com]))


SHORT = {
    "collision:link=3,force=0/0/80,onset=1.1": ("wrist_1_link.force_z", 80.0, 1.3),
    "sensor_fault:joint=1,mode=dropped,onset=1.1,duration=0.3": (
        "shoulder_lift_joint.sensor_dropped",
        1.0,
        1.4,
    ),
    "payload_change:mass=2,onset=1.7": ("payload.mass", 2.0, 1.9),
    "encoder_offset:joint=0,rate=1,onset=1.7": ("shoulder_pan_joint.encoder_offset", 0.2, 1.9),
}


@pytest.mark.parametrize("text", SHORT)
def test_the_truth_has_what_begins_and_ends_within_half_a_second(dynamics, text):
    name, most, end = SHORT[text]
    event = parse_fault(text, 6)
    told = unfolding(dynamics, (event,), 1.9)
    values = told.channels[name]
    changed = told.t[values != values[0]]
    assert values.max() == pytest.approx(most)
    assert changed[0] >= event.onset and changed[-1] <= end + 1e-9
    assert all(np.isclose(told.t, moment).any() for moment in (event.onset, end))
    assert np.diff(told.t).max() <= 0.5


def test_between_its_rows_a_collision_of_the_truth_is_half_a_sine(dynamics):
    push = fault("collision:link=3,force=0/0/1,duration=0.3")
    told, fine = unfolding(dynamics, (push,), 12.0), np.linspace(0.0, 12.0, 12001)
    between = np.interp(fine, told.t, told.channels["wrist_1_link.force_z"])
    assert np.abs(between - course(dynamics, (push,), fine).push[:, 3, 2]).max() < 0.02


def test_a_truth_is_json_or_nothing(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_truth(tmp_path / "truth.json", {"course": [np.inf]})
    assert list(tmp_path.iterdir()) == []
