"""What an arm's innovations are taken to tell: another payload, a drive's trouble, or noise."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from workshop import RATE, commissioned

from urdyn.estimate import EKF
from urdyn.signal import samples
from urdyn.simulate import observe, typical_sensors
from urdyn.simulate.payload import Payload
from urdyn.simulate.work import pick_and_place
from urdyn.tracking import Tracker
from urdyn.tracking.step.abrupt_changes import (
    TOLD,
    WEAR_MEMORY,
    PriorScales,
    detect,
    drive_evidence,
    log_odds,
    no_evidence,
    significant,
    wearing_drive,
)

J = 6
LASTING = 40  # samples


@dataclass(frozen=True)
class Signatures:
    """Of a few seconds at work, in units of the noise."""

    payload: np.ndarray  # (N, J, 4) a kilogram, a kilogram metre
    drives: np.ndarray  # (N, J, 3) Coulomb friction, viscous friction, health; as they are each


def signatures(seed, drive):
    """Some that no motion would have, but of the sizes of an arm's."""
    rng = np.random.default_rng(seed)
    turning = np.cumsum(0.1 * rng.standard_normal((LASTING, J, 4)), axis=0)
    payload = (rng.standard_normal((J, 4)) + turning) * [10.0, 10.0, 10.0, 10.0]
    v, load = rng.standard_normal((2, LASTING, J))
    own = np.stack([np.sign(v), v, load], axis=-1) * np.array([3.0, 6.0, 100.0])
    scale = np.stack([drive.coulomb, drive.viscous, np.ones(J)], axis=-1)
    return Signatures(payload, own / scale)


def told(shapes, e):
    """Evidence of innovations (N, J), with nothing forgotten, that has been sure for a second."""
    row = np.concatenate([shapes.payload, shapes.drives, e[..., None]], axis=-1)
    row *= (3.0 / np.maximum(np.abs(e), 3.0))[..., None]
    sums = np.einsum("njk,njl->jkl", row, row)
    wear = np.stack([sums[:, 4:, 4:]] * len(WEAR_MEMORY))
    return replace(no_evidence(J), sums=np.stack([sums, sums]), wear=wear, highest=30.0, lasted=1.0)


@pytest.fixture(scope="module")
def arm():
    return commissioned(0)[1].dynamics


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mass", [0.5, 2.0, 8.0])
def test_a_payload_is_blamed_on_no_drive(arm, seed, mass):
    """Though what it weighs on the joints is a tenth off, as friction under load makes it."""
    rng, shapes = np.random.default_rng([seed, 1]), signatures(seed, arm.drive)
    weight = shapes.payload @ [mass, 0.0, 0.0, 0.08 * mass]
    e = weight * (1.0 + 0.1 * rng.standard_normal(J)) + rng.standard_normal((LASTING, J))
    what, _ = detect(told(shapes, e), PriorScales.of(arm.drive), np.zeros(10))
    assert what.payload is not None and not what.drives.any()
    # A tenth off in every joint's weight; centred, so that the mass is no further off than that.
    assert abs(what.payload[0] - mass) < 0.1 * mass + 0.3


@pytest.mark.parametrize(("left", "lasts"), [(0.75, True), (0.65, False)])
def test_a_burst_of_which_too_little_is_left_is_nothing(arm, left, lasts):
    """As 36 nats that were 18 a quarter of a second later, in a real run with a load."""
    rng, shapes = np.random.default_rng(3), signatures(3, arm.drive)
    sizes = PriorScales.of(arm.drive)
    e = shapes.payload @ [2.0, 0.0, 0.0, 0.16] + rng.standard_normal((LASTING, J))
    evidence = told(shapes, e)
    evidence = replace(evidence, highest=float(log_odds(evidence, sizes).max()) / left)
    what, after = detect(evidence, sizes, np.zeros(10))
    assert what.anything is lasts
    assert after.lasted == evidence.lasted * lasts


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("size", [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.1)])
def test_a_drive_is_blamed_alone(arm, joint, size):
    rng, shapes = np.random.default_rng([joint, 2]), signatures(joint, arm.drive)
    scale = np.stack([arm.drive.coulomb, arm.drive.viscous, np.ones(J)], axis=-1)[joint]
    e = rng.standard_normal((LASTING, J))
    e[:, joint] += 3.0 * shapes.drives[:, joint] @ (size * scale)
    what, _ = detect(told(shapes, e), PriorScales.of(arm.drive), np.zeros(10))
    assert what.payload is None and np.flatnonzero(what.drives).tolist() == [joint]


@pytest.mark.parametrize("window", [0, 1])
def test_what_changed_is_told_by_the_sums_that_are_surer(arm, window):
    """A drive by some, and a light payload by the others."""
    rng, shapes = np.random.default_rng(6), signatures(6, arm.drive)
    noise = rng.standard_normal((LASTING, J))
    worn = noise.copy()
    worn[:, 2] += 1.2 * shapes.drives[:, 2, 0] * arm.drive.coulomb[2]
    light = noise + shapes.payload @ [0.05, 0.0, 0.0, 0.004]
    sizes, sums = PriorScales.of(arm.drive), told(shapes, light).sums.copy()
    evidence = told(shapes, worn)
    sums[window] = evidence.sums[window]
    evidence = replace(evidence, sums=sums)
    assert 0.0 < log_odds(evidence, sizes)[1 - window].max() < log_odds(evidence, sizes).max()
    what, _ = detect(evidence, sizes, np.zeros(10))
    assert what.payload is None and np.flatnonzero(what.drives).tolist() == [2]


@pytest.mark.parametrize("joint", range(J))
@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("longer", [[3.0, 0.0], [0.0, 5.0]])
def test_a_drive_that_wears_is_told_by_a_longer_time(arm, joint, share, longer):
    """Too little for some seconds; and what is carried is another question."""
    rng, shapes = np.random.default_rng([joint, 5]), signatures(joint, arm.drive)
    e = rng.standard_normal((LASTING, J))
    e[:, joint] += share * shapes.drives[:, joint, 0] * arm.drive.coulomb[joint]
    evidence = told(shapes, e)
    what, _ = detect(evidence, PriorScales.of(arm.drive), np.zeros(10))
    assert not what.drives.any()
    wear = np.array(longer)[:, None, None, None] * evidence.wear
    worn = wearing_drive(replace(drive_evidence(evidence), wear=wear), PriorScales.of(arm.drive))
    assert np.flatnonzero(worn).tolist() == [joint] * (share > 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_noise_is_nothing_and_is_forgotten(arm, seed):
    shapes = signatures(seed, arm.drive)
    e = np.random.default_rng([seed, 3]).standard_normal((LASTING, J))
    evidence = told(shapes, e)
    what, left = detect(evidence, PriorScales.of(arm.drive), np.zeros(10))
    assert not what.anything
    np.testing.assert_array_equal(left.sums[0], evidence.sums[0])
    assert not left.sums[1].any()


@pytest.mark.parametrize("seed", range(5))
def test_what_is_put_down_leaves_nothing(arm, seed):
    """Whatever was carried: with the weight gone, the evidence has it at what is there now."""
    rng, shapes = np.random.default_rng([seed, 4]), signatures(seed, arm.drive)
    before = np.r_[8.0, 0.1, -0.1, 0.6, np.zeros(6)]
    e = rng.standard_normal((LASTING, J)) - shapes.payload @ before[:4]
    evidence = told(shapes, e)
    what, _ = detect(evidence, PriorScales.of(arm.drive), before)
    assert what.payload is not None and not what.drives.any()
    # Each of four is told from nothing where it is 3 sd from it: by chance, once in a hundred arms.
    assert not what.payload.any()


def test_no_evidence_is_none(arm):
    what, _ = detect(no_evidence(J), PriorScales.of(arm.drive), np.zeros(10))
    assert not what.anything


@pytest.mark.parametrize(
    ("before", "now", "carried"),
    [
        (1.3, 0.7 * TOLD, 0.0),  # it may have been put down
        (1.3 * TOLD, 1.1 * TOLD, 1.3 * TOLD),
        (1.3 * TOLD, 2.5 * TOLD, 2.5 * TOLD),
        (0.0, 1.1 * TOLD, 1.1 * TOLD),
    ],
)
def test_what_may_be_nothing_is_nothing_and_what_may_be_the_same_is(before, now, carried):
    """In standard deviations of what is known now."""
    told = significant(np.array([before]), np.array([now]), np.ones(1))
    np.testing.assert_array_equal(told, carried)


@pytest.mark.parametrize(
    ("rate", "duration"), [(20.0, 120.0), pytest.param(RATE, 60.0, marks=pytest.mark.slow)]
)
def test_pieces_come_and_go_and_nothing_else_changes(rate, duration):
    """A story: a program that moves a piece, told at a robot's slow rate and at a quick one."""
    dynamics, fit = commissioned(0)
    streams = [np.random.default_rng([7, k]) for k in range(2)]
    work = pick_and_place(dynamics.arm, duration, rate, streams[0])
    sensors = typical_sensors(dynamics.arm)
    log = observe(dynamics, work.trajectory, sensors, streams[1], work.handling)
    [handling] = work.handling
    tracker = Tracker(fit, EKF(), 1.0 / rate)
    state, at, found, doubted = tracker.init(), tracker.currents.places, [], 0
    for sample in samples(log):
        state, reading = tracker.step(state, sample)
        if reading is not None:
            doubted += reading.inputs.jolted is not None
            found.append((reading.t, reading.widened, reading.belief.mean[at["payload"]][0]))
    assert doubted <= 1  # a drive beside the first piece, when the noise is not yet known
    t, widened, mass = np.array(found).T
    grips = handling.begin[handling.begin < t[-1] - 4.0]
    assert len(grips) > 10
    # It is noticed when the arm moves on, and again within the moves of this piece at the latest.
    noticed = np.array([t[widened > 0][t[widened > 0] > grip][0] - grip for grip in grips])
    assert np.median(noticed) < 2.0
    assert (noticed < 4.0).mean() > 0.95
    last = np.array([mass[t < grip][-1] for grip in grips[1:]])  # before the next
    true = handling.carried[: len(grips) - 1, 0]
    # What a gain is not known by, 2 % of the load, and a tenth of a kilogram: of eight such logs,
    # .93 of grips are. That fewer than .8 of 26 are would be chance once in a hundred logs.
    assert (np.abs(last - true) < 0.1 + 0.02 * true.max()).mean() > 0.8
    belief = tracker.filter.belief(state.belief)
    for group, truth in {"f": np.log(dynamics.drive.coulomb), "z": np.zeros(J)}.items():
        off = belief.mean[at[group]] - truth
        assert (np.abs(off) < 4.0 * belief.sd[at[group]] + 0.02).all(), group


@pytest.mark.slow
def test_heavy_pieces_teach_nothing_wrong_of_gears():
    """A story: many grips of the same heavy piece, each of which could shift friction a little."""
    dynamics, fit = commissioned(0)
    motion, noise = (np.random.default_rng([8, k]) for k in range(2))
    piece = Payload(9.0, np.array([0.0, 0.0, 0.08]))
    work = pick_and_place(dynamics.arm, 250.0, 20.0, motion, piece)
    log = observe(dynamics, work.trajectory, typical_sensors(dynamics.arm), noise, work.handling)
    tracker = Tracker(fit, EKF(), 0.05)
    state, at = tracker.init(), tracker.currents.places
    for sample in samples(log):
        state, _ = tracker.step(state, sample)
    belief = tracker.filter.belief(state.belief)
    drive = dynamics.drive
    for group, truth in {"f": drive.coulomb, "alpha": drive.viscous, "z": drive.health}.items():
        off = (belief.mean[at[group]] - np.log(truth)) / belief.sd[at[group]]
        assert np.sum(off**2) < 22.5, group  # once in a thousand
