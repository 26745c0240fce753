"""What a diagnosis remembers, as a file: its values as a tree, its arrays beside it.

Only the dataclasses of this room are made from it: a file cannot ask for anything else.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.diagnose.backlash import Reversals
from urdyn.diagnose.carried import Mode, Shown
from urdyn.diagnose.carrying import Absence, Carrying, Waiting
from urdyn.diagnose.change import Change, Push
from urdyn.diagnose.creep import Creep
from urdyn.diagnose.encoder import Unseen
from urdyn.diagnose.fast import FastState
from urdyn.diagnose.fault import Fault
from urdyn.diagnose.finding import Finding
from urdyn.diagnose.gathering import Gathering
from urdyn.diagnose.learning import Learnt
from urdyn.diagnose.ledger import Book
from urdyn.diagnose.loudness import Loudness
from urdyn.diagnose.moment import Means, Pool
from urdyn.diagnose.onsets import Bank, Block
from urdyn.diagnose.oscillation import Heard, Ring
from urdyn.diagnose.pushed import Bin
from urdyn.diagnose.quiet import Quiet
from urdyn.diagnose.recall import Recall
from urdyn.diagnose.recurring import Recurred
from urdyn.diagnose.ringing_line import Usual
from urdyn.diagnose.rows import Rows
from urdyn.diagnose.sensor import Felt
from urdyn.diagnose.slow_state import LearntBy, SlowState
from urdyn.diagnose.state import Now, State
from urdyn.diagnose.steadiness import Steadiness
from urdyn.diagnose.warmth import Warmth
from urdyn.errors import InputError
from urdyn.io import writing
from urdyn.signal import Instant
from urdyn.tracking.checkpoint import DAMAGE

KNOWN = (
    Absence, Bank, Bin, Block, Book, Carrying, Change, Creep, Fault, FastState, Felt, Finding,
    Gathering, Heard, Instant, Learnt, LearntBy, Loudness, Means, Mode, Now, Pool, Push, Quiet,
    Recall, Recurred, Reversals, Ring, Rows, Shown, SlowState, State, Steadiness, Unseen, Usual,
    Waiting, Warmth,
)  # fmt: skip
CLASSES = {kind.__name__: kind for kind in KNOWN}


def save(state: State, identity: Mapping[str, str], path: Path) -> None:
    """Write a state, all of it or nothing."""
    arrays: dict[str, Any] = {}
    tree = json.dumps([dict(identity), _tree(state, arrays)])
    with writing(path) as stream:
        np.savez(stream, tree=tree, **arrays)


def load(identity: Mapping[str, str], path: Path) -> State:
    """The state in a file that `save` wrote.

    Raises:
        InputError: it is damaged, or of another run.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            arrays = dict(archive)
        whose, tree = json.loads(str(arrays["tree"]))
        # What another version kept may be of classes that are no more.
        state = _value(tree, arrays) if whose == dict(identity) else None
    except DAMAGE as error:
        raise InputError(f"{path}: is damaged ({error}); start anew with --fresh") from error
    if not isinstance(state, State):
        raise InputError(f"{path}: is of another run; start anew with --fresh")
    return state


def _tree(value: Any, arrays: dict[str, Any]) -> Any:
    """A value in JSON's types; what JSON has no word for is a list that begins with a name."""
    if is_dataclass(value):
        assert CLASSES.get(type(value).__name__) is type(value), f"{type(value)} cannot be read"
        inner = {f.name: _tree(getattr(value, f.name), arrays) for f in fields(value)}
        return ["class", type(value).__name__, inner]
    match value:
        case np.ndarray():
            name = f"a{len(arrays)}"
            arrays[name] = value
            return ["array", name]
        case tuple() | list():
            return [type(value).__name__, [_tree(inner, arrays) for inner in value]]
        case Mapping():
            return ["dict", [[key, _tree(inner, arrays)] for key, inner in value.items()]]
        case np.generic():
            return value.item()
    return value


def _value(tree: Any, arrays: Mapping[str, Any]) -> Any:
    match tree:
        case ["class", str(name), dict(inner)]:
            return CLASSES[name](**{key: _value(x, arrays) for key, x in inner.items()})
        case ["array", str(name)]:
            return arrays[name]
        case ["tuple", list(inner)]:
            return tuple(_value(x, arrays) for x in inner)
        case ["list", list(inner)]:
            return [_value(x, arrays) for x in inner]
        case ["dict", list(inner)]:
            return {key: _value(x, arrays) for key, x in inner}
    return tree
