"""How much more friction a joint has is asked of all its terms together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shop import Shop

from urdyn.diagnose.residual import friction
from urdyn.diagnose.residual.moment import averaged
from urdyn.diagnose.residual.rows import rows
from urdyn.diagnose.residual.space import space
from urdyn.diagnose.residual.warmth import unfelt
from urdyn.diagnose.slow.ailing import Ailing
from urdyn.diagnose.slow.fault import Fault
from urdyn.diagnose.slow.recall import Recall
from urdyn.model.friction import Contact, features
from urdyn.tracking.step.joint_motion import STANDING

FIRST = np.diag([0.06, 0.15, 0.1]) ** 2
OF = np.array([0.5, 0.3, 0.2])
SURE = 1e-8 * np.eye(3)


def test_what_friction_took_is_the_model_s_in_the_way_of_the_motion(shop: Shop) -> None:
    """Where the joint slides on known bristles, and with a term that fades with speed."""
    drive = shop.fit.dynamics.drive
    drive = replace(drive, stribeck=0.4 * drive.coulomb)
    of = replace(space(shop.fit), reference=replace(shop.fit.dynamics, drive=drive))
    motion, s, travelled = shop.motion(shop.log(seconds=6.0))
    part = rows(of, motion, s, travelled, unfelt(of.joints))
    means = averaged(part, 0.02, of.noise)  # rows as they are: nothing is averaged
    terms = features(Contact(motion.q, motion.v, motion.temperature, part.load, s), drive)
    known = part.settled & (np.abs(motion.v) > STANDING)
    weight = np.sign(motion.v) * np.where(known, means.weight, 0.0) / drive.gain
    took = [
        (weight * getattr(drive, name) * terms[name]).sum(axis=0)
        for name in ("coulomb", "viscous", "structural", "stribeck")
    ]
    found = friction.lost(means, drive)
    np.testing.assert_allclose(found[:3], took[:3], rtol=0.03)  # by the instrument's accelerations
    np.testing.assert_allclose(found[3], np.sum(took, axis=0), rtol=0.03)
    share = friction.share([found, 0.0, found], 2)
    assert share is not None
    np.testing.assert_allclose(share, found[:3, 2] / found[3, 2])
    assert friction.share([0.0], 2) is None and friction.share([0.0 * found], 2) is None


def test_before_a_run_friction_is_known_to_what_days_make_of_it() -> None:
    now, before = (np.full(3, 0.5), SURE), (np.zeros(3), FIRST)
    size, sd = friction.rise(OF, now, before, FIRST, 0.03)
    assert size == pytest.approx(0.5) and sd == pytest.approx(1.5 * 0.03, rel=1e-3)


def test_within_a_run_a_change_is_a_share_of_what_was_there_before() -> None:
    """A day by a tenth above the first one is seen, and no day's usual."""
    before, now = (np.full(3, 0.1), SURE), (np.full(3, 0.65), SURE)
    size, sd = friction.rise(OF, now, before, FIRST, 0.02)
    assert size == pytest.approx(0.5, abs=1e-3) and sd < 1e-3


def test_what_terms_make_up_for_is_not_in_the_doubt_about_all_friction() -> None:
    """f and alpha are known together far better than each."""
    trade = np.array([[1.0, -OF[0] / OF[1], 0.0]])
    now = (np.full(3, 0.5), SURE + 0.04 * trade.T @ trade)
    before = (np.zeros(3), FIRST)
    told, sd = friction.rise(OF, now, before, FIRST, 0.02)
    assert sd == pytest.approx(1.5 * 0.02, rel=1e-2)
    apart = friction.apart(now, before, FIRST)
    assert set(apart) == set(friction.NAMES)
    assert apart["coulomb"]["sd"] > 0.2 and apart["viscous"]["sd"] > 0.3
    assert apart["coulomb"]["size"] == pytest.approx(told)


@pytest.mark.parametrize("z", [-0.25, 0.3])  # a fifth of health lost; a sensor that misses current
def test_friction_has_risen_by_as_much_whatever_current_its_drive_takes(
    shop: Shop, z: float
) -> None:
    """All of it is (1 - z) (rest + friction (1 + rise)); a bank has (1 - z) (rest + friction)."""
    extent, rng = shop.diagnosis(shop.log(seconds=2.0)).slow.judge.extent, np.random.default_rng(4)
    k = next(k for k, s in enumerate(extent.of.each) if s.kind.of_friction and s.joint == 2)
    places, n, rise, draws = extent.healthy.space.places, extent.healthy.size, 0.4, 4000
    at = [places[name].start + 2 for name in (*friction.TERMS, "z")]
    x, P, root = np.zeros(n), np.zeros((n, n)), 0.01 * np.tri(4)
    x[at], P[np.ix_(at, at)] = [*np.full(3, rise * (1.0 - z)), z], root @ root.T
    told, cov = extent._friction(x, P, Fault(k, 0.0, 1.0, 2.0, rise))
    np.testing.assert_allclose(told, rise)
    drawn = x[at] + rng.standard_normal((draws, 4)) @ root.T
    spread = np.cov((drawn[:, :3] / (1.0 - drawn[:, 3:])).T)
    np.testing.assert_allclose(cov, spread, atol=4.0 * np.sqrt(2.0 / draws) * cov.max())


def test_sizes_are_held_by_their_intervals_as_often_as_they_say() -> None:
    """Of draws by the belief itself, before and within a run."""
    rng, day, n = np.random.default_rng(3), 0.02, 4000
    held = []
    for sd in (np.inf, 0.02):  # of what the run told of all friction before
        off = day * rng.standard_normal(n)
        var = OF @ FIRST @ OF
        seen = 0.0 if np.isinf(sd) else sd**-2.0
        after = 1.0 / (1.0 / var + seen)
        told = after * seen * (off + (0.0 if np.isinf(sd) else sd) * rng.standard_normal(n))
        blur = 0.03
        now = 1.5 * (1.0 + off) - 1.0 + blur * rng.standard_normal(n)
        for m, x in zip(told, now, strict=True):
            before = (m * np.ones(3), after / var * FIRST)
            spread = blur**2 / var * FIRST
            size, unsure = friction.rise(OF, (x * np.ones(3), spread), before, FIRST, day)
            held.append(abs(size - 0.5) < 1.645 * unsure)
    share = np.reshape(held, (2, n)).mean(axis=1)
    assert np.all(np.abs(share - 0.9) < 0.03)


def test_what_began_before_all_that_is_remembered_is_told_beside_the_first_day(shop: Shop) -> None:
    """What was believed by then had followed it."""
    healthy = shop.diagnosis(shop.log(seconds=2.0)).slow.healthy
    x, P = healthy.first
    recall, arm = Recall(300.0, x + 0.05, P), Ailing(healthy, (), np.ones(6))
    for onset, off in ((100.0, 0.0), (400.0, 0.05)):
        fault = Fault(0, onset, onset, 600.0, 0.1)
        was, _ = recall.before(fault, arm)
        np.testing.assert_array_equal(was, x + off)
