"""What all clients of a controller share: its release, rate, and inputs with one owner each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from urdyn.io.rtde.events import Text
from urdyn.io.rtde.fields import IN_USE, NOT_FOUND, cycle_rate, inputs, outputs
from urdyn.io.rtde.recipe import Values

Generation = Literal["cb3", "e", "x"]
RELEASES: Mapping[Generation, tuple[int, int, int, int]] = {
    "cb3": (3, 15, 8, 0),
    "e": (5, 23, 0, 0),
    "x": (10, 12, 0, 0),
}
KEPT = 100  # text messages
# Inputs that switch digital outputs -> the place of their first bit in actual_digital_output_bits.
SWITCHES = {
    "standard_digital_output": 0,
    "configurable_digital_output": 8,
    "tool_digital_output": 16,
}

# An arm that is switched on, runs a program and is well; for variables that a source leaves out.
WELL: Mapping[str, Any] = {
    "robot_mode": 7,  # running
    "joint_mode": (253,) * 6,  # running
    "safety_mode": 1,  # normal
    "safety_status": 1,  # normal
    "safety_status_bits": 1,  # is in normal mode
    "robot_status_bits": 3,  # power is on, a program runs
    "runtime_state": 2,  # playing
    "speed_scaling": 1.0,
    "target_speed_fraction": 1.0,
    "actual_main_voltage": 48.0,
    "actual_robot_voltage": 48.0,
    "actual_joint_voltage": (48.0,) * 6,
}


@dataclass
class Controller:
    """The state that clients share; each has a session of its own."""

    release: tuple[int, int, int, int] = RELEASES["e"]
    values: dict[str, Any] = field(default_factory=dict)  # what clients set, and what came of it
    messages: list[Text] = field(default_factory=list)  # what clients said, the last KEPT
    _owners: dict[str, object] = field(default_factory=dict)  # input -> the session that sets it

    def __post_init__(self) -> None:
        self.outputs, self.inputs = outputs(self.release), inputs(self.release)

    @property
    def rate(self) -> float:
        """Control cycles a second [Hz]."""
        return cycle_rate(self.release)

    def output_types(self, names: Iterable[str]) -> tuple[str, ...]:
        """Types of outputs, NOT_FOUND for each that this release does not have."""
        return tuple(self.outputs.get(name, NOT_FOUND) for name in names)

    def input_types(self, names: Iterable[str], owner: object) -> tuple[str, ...]:
        """Types of inputs, NOT_FOUND, or IN_USE where another than `owner` sets it."""
        return tuple(
            IN_USE
            if self._owners.get(name, owner) is not owner
            else self.inputs.get(name, NOT_FOUND)
            for name in names
        )

    def claim(self, names: Iterable[str], owner: object) -> None:
        """From now on only `owner` sets these inputs."""
        self._owners |= dict.fromkeys(names, owner)

    def release_claims(self, owner: object) -> None:
        """The owner has gone; its inputs keep their last values."""
        self._owners = {name: who for name, who in self._owners.items() if who is not owner}

    def set(self, values: Values) -> None:
        """Take inputs, and do what they ask for: move the slider, switch outputs."""
        self.values |= values
        if values.get("speed_slider_mask"):
            self.values["target_speed_fraction"] = values.get("speed_slider_fraction", 1.0)
        bits = self.values.get("actual_digital_output_bits", 0)
        for name, place in SWITCHES.items():
            mask = values.get(f"{name}_mask", 0) << place
            bits = bits & ~mask | values.get(name, 0) << place & mask
        self.values["actual_digital_output_bits"] = bits

    def hear(self, text: Text) -> None:
        """Keep a client's message."""
        self.messages = [*self.messages[1 - KEPT :], text]

    def state(self, sample: Values) -> Values:
        """All that outputs are read from: the sample, then inputs, then an arm that is well."""
        return {**WELL, **self.values, **sample}
