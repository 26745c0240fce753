"""The controller's side of one connection: what it answers, and which data it owes; no sockets.

Where the guide is silent it does as controllers do: one output recipe per connection, a new
one replaces the old; recipe id 0 says that a recipe was refused.
"""

from __future__ import annotations

import math

from urdyn.errors import RtdeError
from urdyn.io.rtde import events
from urdyn.io.rtde.controller import Controller
from urdyn.io.rtde.fields import TYPES
from urdyn.io.rtde.recipe import Recipe, Values
from urdyn.io.rtde.wire import controller_wire

SPOKEN = (1, 2)  # protocol versions
INPUT_RECIPES = 255  # ids are one byte, and 0 is none
SOURCE = "RTDE"


class Session:
    """Bytes in, bytes out; `broken` once the client has broken the protocol."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.streaming = False
        self.output: Recipe | None = None
        self.broken: RtdeError | None = None
        self._wire = controller_wire()
        self._inputs: dict[int, Recipe] = {}
        self._due = 0  # control cycles until the next package

    def receive(self, data: bytes) -> bytes:
        """Answers to what the client sent; a last word where it broke the protocol."""
        answers: list[bytes] = []
        try:
            for request in self._wire.feed(data):
                answers += [self._wire.write(answer) for answer in self._answer(request)]
        except RtdeError as error:
            self.broken = error
            answers.append(
                self._wire.write(events.Text(str(error), SOURCE, events.Level.EXCEPTION))
            )
        return b"".join(answers)

    def publish(self, state: Values) -> bytes:
        """The data package that is due in this control cycle; nothing in the cycles between."""
        if not self.streaming or self.output is None:
            return b""
        self._due -= 1
        if self._due > 0:
            return b""
        self._due = int(self.controller.rate // self.output.frequency)
        return self._wire.write(events.Data(self.output.id, self.output.pack(state)))

    def close(self) -> None:
        """Let others set the inputs that this client set."""
        self.controller.release_claims(self)

    def _answer(self, request: events.Request) -> list[events.Answer]:
        match request:
            case events.RequestVersion(version):
                if version in SPOKEN:
                    self._wire.version = version
                return [events.VersionAnswer(version in SPOKEN)]
            case events.GetController():
                return [events.ControllerAnswer(self.controller.release)]
            case events.SetupOutputs(names, frequency):
                return self._setup_outputs(names, frequency)
            case events.SetupInputs(names):
                return self._setup_inputs(names)
            case events.Start():
                self.streaming, self._due = self.output is not None, 0
                return [events.StartAnswer(self.streaming)]
            case events.Pause():
                self.streaming = False
                return [events.PauseAnswer(True)]
            case events.Text():
                self.controller.hear(request)
            case events.Data(recipe, values):
                self._set(recipe, values)
        return []

    def _setup_outputs(
        self, names: tuple[str, ...], frequency: float | None
    ) -> list[events.Answer]:
        """Accept an output recipe, or none of it."""
        types, rate = self.controller.output_types(names), self.controller.rate
        wanted = rate if frequency is None else frequency
        sound = names and TYPES.keys() >= set(types) and len(set(names)) == len(names)
        if not sound or not 0 < wanted < math.inf:
            self.output, self.streaming = None, False
            return [events.OutputsAnswer(types, 0)]
        self.output = Recipe(names, types, min(max(wanted, 1.0), rate), 1)
        return [events.OutputsAnswer(types, self.output.id)]

    def _setup_inputs(self, names: tuple[str, ...]) -> list[events.Answer]:
        """Accept an input recipe and make its variables this client's, or refuse it."""
        types = self.controller.input_types(names, self)
        recipe = len(self._inputs) + 1
        sound = names and TYPES.keys() >= set(types) and len(set(names)) == len(names)
        if not sound or recipe > INPUT_RECIPES:
            return [events.InputsAnswer(types, 0)]
        self._inputs[recipe] = Recipe(names, types, id=recipe)
        self.controller.claim(names, self)
        return [events.InputsAnswer(types, recipe)]

    def _set(self, recipe: int, package: bytes) -> None:
        """Take the values of an input package."""
        if recipe not in self._inputs:
            raise RtdeError(f"no input recipe has id {recipe}")
        wanted = self._inputs[recipe].size
        if len(package) != wanted:
            raise RtdeError(f"input recipe {recipe} has {wanted} bytes, not {len(package)}")
        self.controller.set(self._inputs[recipe].unpack(package))
