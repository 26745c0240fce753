"""What a tracker learnt from one instant, for observers."""

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
    """What was learnt from one instant."""

    t: float  # [s]
    current: Array  # (J,) [A] as measured
    predicted: Array  # (J,) [A] by prior belief and past noise; NaN where nothing was compared
    modelled: Array  # (J,) [A] by the prior belief alone, without the noise
    innovation: Innovation  # white
    widened: bool  # whether a change of payload is reported here
    instant: Instant
    travelled: Array  # (J,) [rad] since the bristles were unknown
    inputs: RobotSlice  # the motion, as the model's inputs
    believed: Callable[[], Gaussian] = field(repr=False)
    told: Callable[[], tuple[Array, Array]] = field(default=lambda: NOTHING, repr=False)
    # Inputs and currents as they were learnt from: whitened.
    learnt: tuple[RobotSlice, Array] | None = field(default=None, repr=False)
    restarted: bool = False  # the belief was reset to the commissioned arm here

    @property
    def unknown(self) -> bool:
        """Whether the payload is learnt anew from here on."""
        return self.widened or self.restarted

    @cached_property
    def belief(self) -> Gaussian:
        """Over the model's states, after this instant."""
        return self.believed()

    @cached_property
    def beside(self) -> tuple[Array, Array]:
        """Means and standard deviations of other streams' own quantities."""
        return self.told()
