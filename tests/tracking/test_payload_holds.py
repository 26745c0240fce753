"""The controller's payload setting beside what is carried, hold by hold."""

import numpy as np
import pytest
from scipy.special import bdtrc

from urdyn.report.setting import set_to
from urdyn.tracking.belief.payload_holds import CHANCE, SETTLED, SIDES, Hold, Holds, by_chance
from urdyn.tracking.belief.payload_setting import Setting, compared


def after_holds(*holds, tool=0.0):
    """A setting after holds of what was set, carried and its sd [kg]."""
    setting = Setting(tool=tool)
    for number, (mass, carried, sd) in enumerate(holds):
        told = np.r_[mass, 0.0, 0.0, 1e-3 * number]
        late = setting.beside(mass + 5.0, 0.01, True, False).heard(told, 0.4 * SETTLED)
        early = late.heard(told, 0.4 * SETTLED).beside(mass + 5.0, 0.01, True, False)
        grown = early.heard(told, SETTLED).beside(carried, sd, True, False)
        setting = grown.beside(0.0, 1.0, False, True)
    return setting


def said_of(*holds, whole=True, tool=0.0):
    found = compared(after_holds(*holds, tool=tool), 0.0, 9.0, whole, False)
    return found["holds"], set_to(found).partition("; ")[2]


def test_a_setting_that_is_wrong_at_every_piece_is_told_from_the_third_hold_on():
    wrong, right = (2.1, 3.0, 0.05), (3.0, 3.05, 0.05)
    for count in range(1, 5):
        holds, said = said_of(*[wrong] * count)
        assert (holds["judged"], holds["too_little"]["holds"]) == (count, count)
        told = f"the setting was too little in {count} of {count} holds, on average "
        assert said == (f"{told}2.10 kg for 3.00 kg" if count >= 3 else "")
    assert "too little in 3 of 4 holds" in said_of(wrong, right, wrong, wrong)[1]
    assert "too little in 5 of 15 holds" not in said_of(*[wrong, right, right] * 4)[1]


def test_both_sides_of_a_setting_that_never_changes_are_told():
    said = said_of(*[(3.0, 5.0, 0.1), (3.0, 1.0, 0.1)] * 5)[1]
    assert said == (
        "the setting was too little in 5 of 10 holds, on average 3.00 kg for 5.00 kg; "
        "the setting was too much in 5 of 10 holds, on average 3.00 kg for 1.00 kg"
    )
    untold = said_of(*[(3.0, 5.0, 0.1), (3.0, 1.0, 0.1)] * 5, whole=False)[1]
    assert (
        untold
        == "the setting was too little in 5 of 10 holds, on average 3.00 kg for at least 5.00 kg"
    )


def test_an_empty_gripper_whose_setting_is_right_is_no_hold():
    piece, empty = (1.9, 3.0, 0.05), (1.2, 1.22, 0.05)
    assert said_of(*[piece, empty] * 3, tool=1.2)[0]["judged"] == 3
    assert said_of(*[piece, (0.0, 1.22, 0.05)] * 3, tool=1.2)[0]["judged"] == 6


def test_right_settings_are_hardly_ever_called_wrong_though_loads_are_known_too_well():
    """Errors of Student's t with 4 degrees of freedom, 1.3 sd large, in 100 shifts of 80 holds."""
    rng, said = np.random.default_rng(4), 0
    for _ in range(100):
        holds = Holds()
        for off in 0.1 * 1.3 * rng.standard_t(4, 80) / np.sqrt(2.0):
            holds = holds.after(Hold(9.0, 3.0 + off, 0.1), 3.0, 0.0)
            said += any(holds.plain(True)[side]["sure"] for side in SIDES)
    assert said == 0


@pytest.mark.parametrize(("k", "n"), [(1, 1), (3, 4), (22, 200), (600, 9000)])
def test_chance_is_that_of_a_binomial_tail(k, n):
    assert by_chance(k, n) == pytest.approx(bdtrc(k - 1, n, CHANCE))
