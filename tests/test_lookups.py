"""What is looked up by a name that is not there is told what may be meant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from urdyn.errors import InputError
from urdyn.identify import Fit
from urdyn.types import Parameters

OF = Parameters(np.array([0.1, 2.0]), ("elbow_joint.coulomb", "forearm_link.mass"), ("A", "kg"))


def test_a_name_that_is_not_there_is_told_which_is_meant() -> None:
    assert OF["forearm_link.mass"] == 2.0
    with pytest.raises(InputError, match=r"no parameter elbow.coulomb; did you mean elbow_joint"):
        OF["elbow.coulomb"]
    with pytest.raises(InputError, match=r"no parameter x; there are elbow_joint.coulomb, forearm"):
        OF["x"]


@pytest.mark.parametrize("ask", [Fit.value, Fit.spread, Fit.informed])
def test_a_fit_is_asked_the_same_way(ask: Any, identified: Fit) -> None:
    with pytest.raises(InputError, match=r"no parameter elbow.coulomb; did you mean elbow_joint"):
        ask(identified, "elbow.coulomb")
