"""What the two sides of an RTDE connection say to each other (UR's RTDE guide, "Protocol")."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """How grave a text message is."""

    EXCEPTION = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


@dataclass(frozen=True)
class Text:
    """A message for people, either way; answered by nothing."""

    message: str
    source: str = ""
    level: int = Level.INFO


@dataclass(frozen=True)
class Data:
    """One data package, either way."""

    recipe: int  # id; 0 on outputs of protocol 1, which has one recipe and no ids
    values: bytes  # as the recipe lays them out


@dataclass(frozen=True)
class RequestVersion:
    """Client: let us speak this protocol."""

    version: int


@dataclass(frozen=True)
class GetController:
    """Client: which release are you?"""


@dataclass(frozen=True)
class SetupOutputs:
    """Client: send me these variables."""

    names: tuple[str, ...]
    frequency: float | None = None  # [Hz]; None in protocol 1, which cannot say


@dataclass(frozen=True)
class SetupInputs:
    """Client: I shall send you these variables."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Start:
    """Client: begin to send data."""


@dataclass(frozen=True)
class Pause:
    """Client: stop sending data."""


@dataclass(frozen=True)
class VersionAnswer:
    """Controller: whether we accept the protocol that you asked for; if not, the old one stays."""

    accepted: bool


@dataclass(frozen=True)
class ControllerAnswer:
    """Controller: my release."""

    release: tuple[int, int, int, int]  # major, minor, bugfix, build


@dataclass(frozen=True)
class OutputsAnswer:
    """Controller: types of the outputs, or NOT_FOUND."""

    types: tuple[str, ...]
    recipe: int = 0  # id; 0: refused, and always in protocol 1


@dataclass(frozen=True)
class InputsAnswer:
    """Controller: types of the inputs, or NOT_FOUND, or IN_USE."""

    types: tuple[str, ...]
    recipe: int = 0  # id; 0: refused


@dataclass(frozen=True)
class StartAnswer:
    """Controller: data follow, or not."""

    accepted: bool


@dataclass(frozen=True)
class PauseAnswer:
    """Controller: no data follow."""

    accepted: bool


Request = RequestVersion | GetController | SetupOutputs | SetupInputs | Start | Pause | Text | Data
Answer = (
    VersionAnswer
    | ControllerAnswer
    | OutputsAnswer
    | InputsAnswer
    | StartAnswer
    | PauseAnswer
    | Text
    | Data
)
