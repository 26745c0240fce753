"""The client's side of the set-up: what it asks, and what it makes of the answers; no sockets."""

from __future__ import annotations

from collections.abc import Collection, Generator
from dataclasses import dataclass
from typing import TypeVar

from urdyn.errors import RtdeError
from urdyn.io.rtde import events
from urdyn.io.rtde.fields import NOT_FOUND, TYPES, cycle_rate
from urdyn.io.rtde.recipe import Recipe

LONGEST = 2048  # [bytes] of names that a controller takes, by the guide
Kind = TypeVar("Kind")
# Requests with their version, answers, result.
Talk = Generator[tuple[events.Request, int], events.Answer, Kind]


@dataclass(frozen=True)
class Agreement:
    """What client and controller agreed on."""

    recipe: Recipe
    version: int  # of the protocol
    release: tuple[int, int, int, int]  # of the controller
    left_out: tuple[str, ...] = ()  # optional names that this controller does not know

    @property
    def frequency(self) -> float:
        """Packages a second [Hz]: controllers send every n-th cycle, whatever was asked."""
        rate = cycle_rate(self.release)
        return rate / (rate // self.recipe.frequency)

    @property
    def period(self) -> float:
        """Time between packages [s]."""
        return 1.0 / self.frequency


def handshake(
    names: Collection[str], optional: Collection[str], frequency: float | None
) -> Talk[Agreement]:
    """Set an output recipe up and start it; protocol 2, else 1.

    Yields what to ask and the protocol to ask it in; takes the answer. Of `names` those that are
    `optional` may be unknown to the controller. `frequency` [Hz], None: all that the controller
    has. RtdeError where the controller refuses.
    """
    version = yield from _agree_version()
    answer = yield events.GetController(), version
    release = _expect(events.ControllerAnswer, answer).release
    rate = cycle_rate(release)
    wanted = rate if frequency is None or version == 1 else min(max(frequency, 1.0), rate)
    recipe, left_out = yield from _agree_recipe(names, optional, wanted, version)
    answer = yield events.Start(), version
    if not _expect(events.StartAnswer, answer).accepted:
        raise RtdeError("the controller does not start; is it booted, and its RTDE service on?")
    return Agreement(recipe, version, release, left_out)


def _agree_version() -> Talk[int]:
    """The highest protocol that both speak."""
    for version in (2, 1):
        answer = yield events.RequestVersion(version), 1
        if _expect(events.VersionAnswer, answer).accepted:
            return version
    raise RtdeError("the controller speaks neither RTDE protocol 2 nor 1")


def _agree_recipe(
    names: Collection[str], optional: Collection[str], frequency: float, version: int
) -> Talk[tuple[Recipe, tuple[str, ...]]]:
    """The recipe, without the optional names that the controller does not know; and these."""
    asked = tuple(dict.fromkeys(names))
    types, recipe = yield from _set_up(asked, frequency, version)
    unknown = {name for name, type_ in zip(asked, types, strict=True) if type_ == NOT_FOUND}
    if needed := [name for name in asked if name in unknown and name not in optional]:
        raise RtdeError(f"the controller does not know {', '.join(needed)}; ask for others")
    left_out = tuple(name for name in asked if name in unknown)
    if left_out:
        asked = tuple(name for name in asked if name not in unknown)
        types, recipe = yield from _set_up(asked, frequency, version)
    if not TYPES.keys() >= set(types) or (version > 1 and not recipe):
        raise RtdeError(f"the controller refuses the recipe {', '.join(asked)} at {frequency} Hz")
    return Recipe(asked, types, frequency, recipe), left_out


def _set_up(
    names: tuple[str, ...], frequency: float, version: int
) -> Talk[tuple[tuple[str, ...], int]]:
    """Types and recipe id that the controller answers."""
    if len(",".join(names)) > LONGEST:
        raise RtdeError(f"controllers take {LONGEST} bytes of names; ask for fewer")
    answer = yield events.SetupOutputs(names, None if version == 1 else frequency), version
    outputs = _expect(events.OutputsAnswer, answer)
    if len(outputs.types) != len(names):
        raise RtdeError(f"the controller answers {len(outputs.types)} types to {len(names)} names")
    return outputs.types, outputs.recipe


def _expect(kind: type[Kind], answer: events.Answer) -> Kind:
    """The answer, which is to be of one kind."""
    if not isinstance(answer, kind):
        raise RtdeError(f"the controller answers {type(answer).__name__}, not {kind.__name__}")
    return answer
