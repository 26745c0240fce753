"""A tool as it is asked for, and what the controller took for it."""

import numpy as np
import pytest

from urdyn.cli.tool import Tool, remark, setting_of, tool_of
from urdyn.errors import InputError
from urdyn.simulate import Payload, simulate

HAND = Tool(1.2, (0.0, 0.0, 0.05))


def test_a_tool_is_a_mass_and_its_centre_or_none():
    assert tool_of((1.2, 0.0, 0.0, 0.05)) == HAND
    assert not tool_of((0.0,)).inertials().any()
    for part in ((1.2,), (1.2, 0.0), (0.0, 0.1)):  # at the flange itself no tool has its centre
        with pytest.raises(InputError, match=r"tool [\d.,]+: MASS,X,Y,Z .* within the last link"):
            tool_of(part)


@pytest.mark.parametrize(
    ("tool", "setting", "words"),
    [
        (None, HAND, "was not used: if the arm bore that, --tool 1.2,0,0,0.05"),
        (None, Tool(1.2, (np.nan,) * 3), "if the arm bore that, --tool 1.2,X,Y,Z tells it apart"),
        (Tool(2.0, HAND.com), HAND, "was set to 1.20 kg while this was recorded, and not to the 2"),
        (HAND, HAND, ""),
        (HAND, None, ""),
        (None, None, ""),
        (None, Tool(0.0, HAND.com), ""),
    ],
)
def test_a_setting_is_told_and_not_used(tool, setting, words):
    said = remark(tool, setting)
    assert words in said and bool(said) == bool(words)


def test_a_virtual_controller_is_set_to_what_its_arm_carries(ur5e):
    for payload, mass in ((None, 0.0), (Payload(1.2, np.array(HAND.com)), 1.2)):
        log, _ = simulate(ur5e, 1.0, 100.0, seed=1, payload=payload)
        assert setting_of(log).mass == mass
    assert setting_of(log) == HAND
