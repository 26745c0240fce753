"""Two loops that ring at once are two findings; what one of them shakes is none."""

from __future__ import annotations

import numpy as np
import pytest
from realarm import with_current
from shop import Shop

from urdyn.diagnose import Report, diagnose

Swing = tuple[int, float, float, float]  # joint, [Hz], [N·m], [s] since


def _rings(shop: Shop, *swings: Swing, rate: float = 125.0) -> tuple[Report, float]:
    """What is told of an arm with these swings, and when its log begins [s]."""
    log = shop.log(seconds=12.0, rate=rate)
    current = log.joint("actual_current").copy()
    for joint, frequency, size, since in swings:
        age = log.t - log.t[0] - since
        swing = size * np.sin(2.0 * np.pi * frequency * age) / shop.dynamics.drive.gain[joint]
        current[:, joint] += np.where(age > 0.0, swing, 0.0)
    return diagnose(shop.fit, with_current(log, current)), float(log.t[0])


@pytest.mark.parametrize("rate", [125.0, pytest.param(500.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "swings",
    [
        ((2, 9.0, 2.0, 5.0), (4, 14.0, 2.0, 5.0)),
        ((2, 9.0, 2.0, 5.0), (4, 14.0, 2.0, 8.0)),
        pytest.param(((4, 14.0, 2.0, 5.0), (2, 9.0, 2.0, 8.0)), marks=pytest.mark.slow),
        ((2, 9.0, 4.0, 5.0), (4, 18.0, 2.0, 5.0)),  # an octave
    ],
)
def test_two_loops_that_ring_at_once_are_two_findings(
    shop: Shop, swings: tuple[Swing, ...], rate: float
) -> None:
    """Each with its own frequency, size and onset, whichever began first."""
    report, begin = _rings(shop, *swings, rate=rate)
    told = {f.joint: f for f in report}
    assert told.keys() == {joint for joint, *_ in swings}
    for joint, frequency, size, since in swings:
        found = told[joint]
        assert np.isclose(found.evidence["frequency_Hz"], frequency, atol=0.3)
        assert np.isclose(found.size, size, rtol=0.2)
        assert abs(found.onset_s - begin - since) < 0.9
        assert found.alarm_s - found.onset_s < 1.6


def test_what_a_loop_that_rings_shakes_is_no_finding_of_its_own(shop: Shop) -> None:
    """At its frequency, in the joints beside it, and in one that rings by itself as well."""
    shaken = ((1, 9.0, 1.5, 5.0), (3, 9.0, 0.9, 5.0), (4, 9.0, 0.6, 5.0))
    own = ((2, 9.0, 6.0, 5.0), (4, 14.0, 2.0, 7.0))
    report, _ = _rings(shop, *own, *shaken)
    told = {f.joint: f.evidence["frequency_Hz"] for f in report}
    assert told.keys() == {2, 4}
    assert np.allclose([told[2], told[4]], [9.0, 14.0], atol=0.3)


def test_a_loop_rings_beside_a_sensor_that_is_stuck(shop: Shop) -> None:
    """The sensor of one joint mutes no other."""
    log = shop.log(seconds=6.0)
    age, current = log.t - log.t[0], log.joint("actual_current").copy()
    current[age > 2.0, 5] = current[age > 2.0, 5][0]
    swing = 2.0 * np.sin(2.0 * np.pi * 9.0 * age) / shop.dynamics.drive.gain[2]
    current[:, 2] += np.where(age > 3.5, swing, 0.0)
    told = {f.joint: f.kind for f in diagnose(shop.fit, with_current(log, current))}
    assert told == {5: "sensor_fault", 2: "controller_instability"}


def test_a_joint_of_two_lines_is_one_finding_of_the_louder(shop: Shop) -> None:
    [found], _ = _rings(shop, (4, 9.0, 1.0, 4.0), (4, 14.0, 3.0, 7.0))
    assert found.joint == 4
    assert np.isclose(found.evidence["frequency_Hz"], 14.0, atol=0.3)
