"""The largest payload that an arm's maker allows, tool included."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from urdyn.model.arm import Arm
from urdyn.model.ur_type import ur_type

# [kg] by an arm's name or UR type
RATED: Mapping[str, float] = {
    "ur3": 3.0,
    "ur3e": 3.0,
    "ur5": 5.0,
    "ur5e": 5.0,
    "ur7e": 7.5,
    "ur10": 10.0,
    "ur10e": 12.5,
    "ur12e": 12.5,
    "ur16e": 16.0,
    "ur20": 20.0,
    "ur30": 30.0,
}


def rated_payload(arm: Arm, rated: Mapping[str, float] = RATED) -> float:
    """The rated payload of an arm [kg]; inf: not known."""
    return rated.get(arm.name, rated.get(ur_type(arm), np.inf))
