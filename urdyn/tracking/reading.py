"""What one instant told a tracker, for those who look on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from urdyn.dbn.robot_slice import RobotSlice
from urdyn.estimate import Innovation
from urdyn.signal import Instant
from urdyn.types import Array, Gaussian

NOTHING = (np.zeros(0), np.zeros(0))  # of other streams


@dataclass(frozen=True, eq=False)
class Reading:
    """What one instant told."""

    t: float  # [s]
    current: Array  # (J,) [A] as measured
    predicted: Array  # (J,) [A] by the belief before and the noise; NaN where nothing was compared
    modelled: Array  # (J,) [A] by the belief before alone, whatever the noise does
    innovation: Innovation  # white
    widened: bool  # the payload was taken to have changed here
    instant: Instant
    travelled: Array  # (J,) [rad] since the bristles were unknown
    inputs: RobotSlice  # what the motion made of the parameters
    believed: Callable[[], Gaussian] = field(repr=False)
    told: Callable[[], tuple[Array, Array]] = field(default=lambda: NOTHING, repr=False)
    # Inputs and currents as they were learnt from, after the filter that makes noise white.
    learnt: tuple[RobotSlice, Array] | None = field(default=None, repr=False)
    restarted: bool = False  # the belief began anew here, with the commissioned arm

    @property
    def unknown(self) -> bool:
        """Whether what is carried is learnt anew from here on."""
        return self.widened or self.restarted

    @cached_property
    def belief(self) -> Gaussian:
        """Over the model's states, this instant learnt."""
        return self.believed()

    @cached_property
    def beside(self) -> tuple[Array, Array]:
        """Means and standard deviations of what other streams tell of by themselves."""
        return self.told()
