"""What befalls a joint's drive at once is followed there, and taken for nothing else."""

from dataclasses import dataclass

import numpy as np
import pytest
from workshop import RATE, at_work, commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.tracking import Tracker
from urdyn.tracking.belief.blocks import Blocks
from urdyn.tracking.belief.physical import quantities

HALF = 0.5 * RATE  # [Hz] most of it is told by half as many samples
ONSET, DURATION = 8.0, 20.0  # [s]


@dataclass(frozen=True)
class Followed:
    """What a run ended in, against the day of commissioning, and what it took to happen."""

    change: dict  # "elbow_joint.coulomb" -> ratio, or difference of what may be 0
    sd: dict
    jolted: list  # (time [s], joint)
    widened: list  # [s]


def followed(filter_, *faults, seed=0, seconds=DURATION, rate=HALF):
    dynamics, fit = commissioned(seed)
    tracker = Tracker(fit, filter_, 1.0 / rate)
    physical = quantities(fit, tracker.currents)
    state, jolted, widened = tracker.init(), [], []
    for sample in samples(at_work(dynamics, seed, 2, seconds, *faults, rate=rate)):
        state, reading = tracker.step(state, sample)
        if reading is None:
            continue
        widened += [reading.t] * reading.widened
        if reading.inputs.jolted is not None:
            jolted += [(reading.t, int(j)) for j in np.flatnonzero(reading.inputs.jolted)]
    first, _ = physical.of(tracker.model.prior)
    mean, sd = physical.of(reading.belief)
    scale = np.where(first > 0.05, first, 1.0)
    change = np.where(first > 0.05, mean / scale, mean - first)
    named = (dict(zip(physical.names, x, strict=True)) for x in (change, sd / scale))
    return Followed(*named, jolted, widened)


# What varies within a wait is lost.
MODES = {"full": (EKF(), 0.1), "simplified": (Blocks(), 0.1), "realtime": (Blocks(8), 0.15)}


@pytest.mark.parametrize(
    "mode", ["full", pytest.param("simplified", marks=pytest.mark.slow), "realtime"]
)
def test_friction_that_grows_by_half_at_once_is_followed(mode):
    filter_, loss = MODES[mode]
    fault = f"friction_increase:joint=2,onset={ONSET},rate=0.5,viscous=0.5,shape=step"
    found = followed(filter_, fault)
    assert {joint for _, joint in found.jolted} == {2} and not found.widened
    assert found.jolted[0][0] - ONSET < 1.5
    for name in ("coulomb", "viscous"):
        assert found.change[f"elbow_joint.{name}"] == pytest.approx(1.5, abs=loss)
        assert found.change[f"wrist_1_joint.{name}"] == pytest.approx(1.0, abs=0.06)
    assert abs(found.change["payload.mass"]) < 0.1


@pytest.mark.parametrize(
    ("joint", "name", "seed", "onset"), [(1, "shoulder_lift", 1, 5.0), (4, "wrist_2", 0, 7.0)]
)
def test_friction_that_grows_while_noise_is_quickly_learnt_is_no_noise(joint, name, seed, onset):
    """A run's first seconds tell most of its noise; what a drive then leaves is not of it."""
    fault = f"friction_increase:joint={joint},onset={onset},rate=0.3,viscous=0.3,shape=step"
    found = followed(EKF(), fault, seed=seed)
    assert {joint for _, joint in found.jolted} == {joint} and not found.widened
    assert found.change[f"{name}_joint.coulomb"] == pytest.approx(1.3, abs=0.1)


@pytest.mark.parametrize(
    ("joint", "name", "seed"),
    [pytest.param(0, "shoulder_pan", 0, marks=pytest.mark.slow), (3, "wrist_1", 1)],
)
def test_a_drive_that_loses_a_sixth_at_once_is_followed(joint, name, seed):
    fault = f"health_degradation:joint={joint},onset={ONSET},rate=0.15,shape=step"
    found = followed(EKF(), fault, seed=seed, rate=RATE)
    assert {joint for _, joint in found.jolted} == {joint} and not found.widened
    assert found.change[f"{name}_joint.health"] == pytest.approx(0.85, abs=0.02)
    assert found.change[f"{name}_joint.coulomb"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_most_arms_that_lose_a_sixth_in_a_wrist_are_followed():
    """It is the least that shows at once: where a wrist bears little it does not."""
    fault = f"health_degradation:joint=3,onset={ONSET},rate=0.15,shape=step"
    arms = [followed(EKF(), fault, seed=seed, rate=RATE) for seed in range(8)]
    assert sum({joint for _, joint in arm.jolted} == {3} for arm in arms) >= 6
    assert not any(arm.widened for arm in arms)


def test_two_drives_at_once_are_followed():
    faults = [
        f"friction_increase:joint={j},onset={ONSET},rate=0.8,viscous=0.8,shape=step" for j in (0, 4)
    ]
    found = followed(EKF(), *faults)
    for joint in ("shoulder_pan_joint", "wrist_2_joint"):
        assert found.change[f"{joint}.coulomb"] == pytest.approx(1.8, abs=0.15)
    assert found.change["elbow_joint.coulomb"] == pytest.approx(1.0, abs=0.06)


WEARS, SECONDS = 10.0, 60.0  # [s]


@pytest.mark.parametrize(
    ("joint", "name", "mode"),
    [
        pytest.param(0, "shoulder_pan", "full", marks=pytest.mark.slow),
        (2, "elbow", "full"),
        pytest.param(2, "elbow", "simplified", marks=pytest.mark.slow),
        pytest.param(2, "elbow", "realtime", marks=pytest.mark.slow),
    ],
)
def test_friction_that_grows_within_a_minute_is_followed(joint, name, mode):
    """Fifty times what a healthy arm strays in a second: the drive, and how fast it goes on."""
    filter_, _ = MODES[mode]
    rate = 0.01  # [1/s]
    fault = f"friction_increase:joint={joint},onset={WEARS},rate={rate},viscous={rate}"
    found = followed(filter_, fault, seconds=SECONDS)
    assert {j for _, j in found.jolted} == {joint} and not found.widened
    assert found.jolted[0][0] - WEARS < 25.0
    truth = 1.0 + rate * (SECONDS - WEARS)
    assert found.change[f"{name}_joint.coulomb"] == pytest.approx(truth, abs=0.15)
    assert found.change["wrist_1_joint.coulomb"] == pytest.approx(1.0, abs=0.06)


@pytest.mark.slow
def test_friction_that_grows_slower_is_followed_too():
    """By .1 % a second: with an interval of half a per cent, a third of that was tracked before."""
    rate, seconds = 0.001, 100.0  # [1/s], [s]
    fault = f"friction_increase:joint=2,onset={WEARS},rate={rate},viscous={rate}"
    found = followed(EKF(), fault, seconds=seconds, rate=RATE)
    assert {j for _, j in found.jolted} == {2} and not found.widened
    truth = 1.0 + rate * (seconds - WEARS)
    assert found.change["elbow_joint.coulomb"] == pytest.approx(truth, abs=0.03)
    assert found.change["wrist_1_joint.coulomb"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_health_that_fades_within_a_minute_is_followed():
    fade = f"health_degradation:joint=1,onset={WEARS},rate=0.004"
    found = followed(EKF(), fade, seconds=SECONDS, rate=RATE)
    assert {j for _, j in found.jolted} == {1} and not found.widened
    assert found.change["shoulder_lift_joint.health"] == pytest.approx(0.8, abs=0.03)
    assert found.change["shoulder_lift_joint.coulomb"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("mass", [0.5, pytest.param(2.5, marks=pytest.mark.slow)])
def test_a_payload_is_no_joint_s_fault(mass):
    found = followed(EKF(), f"payload_change:mass={mass},com=0/0/0.08,onset={ONSET}")
    assert found.change["payload.mass"] == pytest.approx(mass, rel=0.1)
    for name, ratio in found.change.items():
        if name.endswith(".coulomb"):
            assert ratio == pytest.approx(1.0, abs=0.08), name


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_nothing_befalls_a_healthy_arm(seed):
    found = followed(EKF(), seed=seed)
    assert not found.jolted and not found.widened
