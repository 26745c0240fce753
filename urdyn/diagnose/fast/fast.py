"""Fast kinds: a quarter of a second of rows in, events out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from urdyn.diagnose.fast.backlash import Backlash, Reversals
from urdyn.diagnose.fast.collision import Collision
from urdyn.diagnose.fast.encoder_zero import shifted
from urdyn.diagnose.fast.observability import Observability
from urdyn.diagnose.fast.oscillation import Heard, Oscillation
from urdyn.diagnose.fast.quiet import Quiet
from urdyn.diagnose.fast.sensor import Felt, SensorHealth
from urdyn.diagnose.kinds.event import Event
from urdyn.diagnose.kinds.fast_rules import FastRules
from urdyn.diagnose.residual.rows import Rows
from urdyn.diagnose.residual.space import Space
from urdyn.types import Array, Mask


@dataclass(frozen=True, eq=False)
class FastState:
    """All that is kept from beat to beat."""

    sensors: Felt
    quiet: Quiet
    heard: Heard
    reversals: Reversals


@dataclass(frozen=True, eq=False)
class Fast:
    """All fast tests: a beat in, events out."""

    space: Space
    period: float  # [s] between rows
    rules: FastRules
    jump: float  # [rad] of an encoder's zero, from which it is reported

    @cached_property
    def sensors(self) -> SensorHealth:
        """Test for faulty sensors."""
        return SensorHealth(self.space, self.period, self.rules.sensor_silent)

    @cached_property
    def collision(self) -> Collision:
        """Test for pushes."""
        return Collision(self.space, self.rules.collision)

    @cached_property
    def oscillation(self) -> Oscillation:
        """Test for loops that ring."""
        return Oscillation(self.space, self.period, self.rules.controller_instability)

    @cached_property
    def backlash(self) -> Backlash:
        """Test for gears with a gap."""
        return Backlash(self.space, self.period, self.rules.joint_backlash)

    @cached_property
    def observability(self) -> Observability:
        """Which gaps could have been seen."""
        return Observability(self.space, self.backlash.rule)

    def init(self) -> FastState:
        """Before the first beat."""
        return FastState(
            self.sensors.init(),
            self.collision.init(),
            self.oscillation.init(),
            self.backlash.init(),
        )

    def step(
        self, state: FastState, rows: Rows, carried: Array
    ) -> tuple[FastState, list[Event], Mask]:
        """One beat on; also which currents are not trusted, (N, J).

        Args:
            carried: possible inertials at the tool, the likeliest first, (k, 10).
        """
        now = float(rows.t[-1])
        torn = self.sensors.torn(rows)
        if np.count_nonzero(torn):
            rows = replace(rows, current=np.where(torn, np.nan, rows.current))
        perhaps = self.oscillation.perhaps(state.heard, now)
        sensors, sick, ill = self.sensors.step(state.sensors, rows, torn, perhaps)
        # What commissioning has not told of a joint would pass for pushes, gaps and wear.
        unknown = self.space.unlearnt
        doubted = ill | self.sensors.unsteady(sensors) | unknown
        quiet, pushes = self.collision.step(state.quiet, rows, carried, doubted)
        heard, rings = self.oscillation.step(state.heard, rows, ill)
        ringing = self.oscillation.ringing(heard, now)
        swung = self.oscillation.swung(heard)
        reversals, gaps, open_now = self.backlash.step(
            state.reversals,
            rows,
            tool=carried[0],
            ill=doubted | ringing,
            swung=swung,
            loud=quiet.loud,
        )
        events = [*sick, *pushes, *rings, *gaps, *shifted(rows, self.jump)]
        untrue = ill | open_now | ringing | torn | unknown
        return FastState(sensors, quiet, heard, reversals), events, untrue

    def observable(self, state: FastState) -> list[dict[str, Any]]:
        """Joint by joint, whether a gap could have been seen."""
        return self.observability.of(state.reversals)
