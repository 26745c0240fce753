"""Reading rules: the package's own, and what a plant's file puts in their place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from urdyn.diagnose.kinds.fast_rules import fast_rules
from urdyn.diagnose.kinds.rules import (
    FAMILIES,
    JOINT_STATES,
    PAYLOAD_STATES,
    SHAPES,
    Noise,
    Rules,
    SlowKind,
)
from urdyn.errors import InputError
from urdyn.faults.decision import Costs
from urdyn.io.document import load_toml
from urdyn.model.rated_payload import RATED

LEVELS = ("least", "warning", "critical")
UNITS = {"k": "rad", "o": "of Coulomb friction", "mass": "kg"}  # of a state's change; else relative
UNITS |= dict.fromkeys(PAYLOAD_STATES[1:], "kg·m")
NYQUIST = 250.0  # [Hz] of the fastest recordings
HUGE = 1e100  # beyond which a number's powers overflow
NUMBER = "finite number"

# Keys of a slow kind's table, and their types.
SLOW: Mapping[str, Any] = {
    "change": {},
    "least": 0.0,
    "warning": 0.0,
    "critical": 0.0,
    "sign": 0,
    "family": "",
    "told_as": "",
    "shapes": [],
    "quantity": "",
    "unit": "",
    "advice": "",
    "looks_like": "",
    "hold": 0.0,
    "hold_lighter": 0.0,
}

Range = tuple[Callable[[float], bool], str]
NOT_NEGATIVE: Range = (lambda x: x >= 0.0, "0 or more")
ABOVE_ZERO: Range = (lambda x: x > 0.0, "above 0")
# Ranges of numbers, by name; any other is not negative.
RANGES: Mapping[str, Range] = {
    **dict.fromkeys(("hours", "shift", "promise", "least", "threshold"), ABOVE_ZERO),
    **dict.fromkeys(("lasting", "noisy", "recurs"), ABOVE_ZERO),
    **dict.fromkeys((*JOINT_STATES, *PAYLOAD_STATES), ABOVE_ZERO),
    **dict.fromkeys((cost.name for cost in fields(Costs)), ABOVE_ZERO),
    "share": (lambda x: 0.0 <= x <= 1.0, "from 0 to 1"),
    "enough": (lambda x: x >= 1.0, "1 or more"),
    "lowest": (lambda x: 0.0 < x < NYQUIST, f"above 0 and below {NYQUIST:g}"),
    "sign": (lambda x: x in (-1, 0, 1), "-1, 0 or 1"),
}


def read_rules(path: str | Path | None = None) -> Rules:
    """The rules in a file; the package's own where none is given.

    Raises:
        InputError: it is no rules file; says where and why.
    """
    house = load_toml(Path(__file__).with_name("rules.toml")) | {"rated": dict(RATED)}
    if path is None:
        return _rules(house, "rules.toml")
    own = load_toml(path)
    _check_like(own, {section: {} for section in house}, f"{path}:")
    for section in ("promise", "healthy", "friction", "warmth", "noise", "rated", "costs"):
        _check_like(own.get(section, {}), house[section], f"{path}: [{section}]")
    merged = {section: of | own.get(section, {}) for section, of in house.items()}
    for state, of in own.get("healthy", {}).items():
        merged["healthy"][state] = house["healthy"][state] | of
    for name, of in own.get("kind", {}).items():
        if not name.strip():
            raise InputError(f'{path}: [kind."{name}"] needs a name: it is told in findings')
        merged["kind"][name] = _kind(of, house["kind"].get(name, {}), f"{path}: [kind.{name}]")
    return _rules(merged, str(path))


def _check_like(own: Mapping[str, Any], house: Mapping[str, Any], where: str) -> None:
    """InputError unless names and types are as in the package's table, and numbers in range."""
    for name, value in own.items():
        if name not in house:
            raise InputError(f"{where} has {name}; there is {', '.join(house)}")
        if (sort := _sort(house[name])) != _sort(value):
            raise InputError(f"{where} {name} is a {sort}")
        possible, words = RANGES.get(name, NOT_NEGATIVE)
        if sort == NUMBER and not possible(value):
            raise InputError(f"{where} {name} is {words}, not {value}")
        if sort == "table" and house[name]:
            _check_like(value, house[name], f"{where} {name}")


def _sort(value: Any) -> str:
    if type(value) in (int, float) and abs(value) < HUGE:
        return NUMBER
    sorts: dict[type, str] = {str: "text", list: "list", dict: "table"}
    return sorts.get(type(value), "value of another sort")


def _kind(own: Any, house: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """A plant's table of a kind, completed from the package's."""
    if not isinstance(own, dict):
        raise InputError(f"{where} is a table")
    merged = {**house, **own}
    if "change" not in merged and not house:
        raise InputError(f"{where} needs a change; tests of other kinds are in the code")
    if house and "change" in own and "change" not in house:
        raise InputError(
            f"{where} takes no change: its test is in the code; a kind of another name does"
        )
    if "change" not in merged:
        _check_like(own, house, where)
    return merged


def _rules(document: Mapping[str, Any], path: str) -> Rules:
    kinds = document["kind"]
    slow = tuple(_slow(name, dict(of), path) for name, of in kinds.items() if "change" in of)
    fast = fast_rules({name: of for name, of in kinds.items() if "change" not in of})
    for name, of in kinds.items():
        levels = [of[level] for level in LEVELS if level in of]
        if levels != sorted(levels):
            raise InputError(f"{path}: [kind.{name}] {', '.join(LEVELS)} do not ascend")
    warmth, named = document["warmth"], document["named"]
    _check_like(named, {kind: [] for kind in kinds}, f"{path}: [named]")
    for name, of in named.items():
        _check_counts(name, of, path)
    try:
        noise, costs = Noise(**document["noise"]), Costs(**document["costs"])
    except InputError as error:
        raise InputError(f"{path}: [costs] {error}") from None
    hours, shift = (float(document["promise"][x]) for x in ("hours", "shift"))
    return Rules(
        hours=hours,
        shift=shift,
        healthy=document["healthy"],
        warmth=warmth,
        friction=document["friction"],
        noise=noise,
        slow=slow,
        fast=fast,
        costs=costs,
        named=named,
        rated=document["rated"],
    )


def _check_counts(name: str, of: list[Any], path: str) -> None:
    whole = len(of) == 2 and all(type(x) is int for x in of)
    if not whole or not 0 <= of[0] <= of[1]:
        raise InputError(f"{path}: [named] {name} is [right, told]: whole numbers, right the fewer")


def _slow(name: str, of: dict[str, Any], path: str) -> SlowKind:
    where = f"{path}: [kind.{name}]"
    _check_like(of, SLOW, where)
    if not of["change"]:
        raise InputError(f"{where} changes nothing")
    known = PAYLOAD_STATES if set(of["change"]) & set(PAYLOAD_STATES) else JOINT_STATES
    needed = LEVELS[:-1] if next(iter(of["change"])) == "mass" else LEVELS
    if missing := [level for level in needed if level not in of]:
        raise InputError(f"{where} has no {' and no '.join(missing)}")
    _check_like(of["change"], dict.fromkeys(known, 0.0), f"{where} change")
    of["shapes"] = tuple(of.get("shapes", SHAPES))
    if not of["shapes"] or not all(shape in SHAPES for shape in of["shapes"]):
        raise InputError(f"{where} shapes are {' and '.join(SHAPES)}, or one of them")
    of["family"] = of.get("family") or _family(of)
    of["unit"] = of.get("unit") or UNITS.get(next(iter(of["change"])), "-")
    _check_family(of, where)
    return SlowKind(name, **of)


def _family(of: Mapping[str, Any]) -> str:
    """Family of a kind that does not name it, by the state that measures it."""
    first = next(iter(of["change"]))
    if first == "z":  # no drive needs less current for everything
        return "sensor" if of.get("sign", 0) > 0 else "health"
    return "payload" if first in PAYLOAD_STATES else "joint"


def _check_family(of: Mapping[str, Any], where: str) -> None:
    family, first = of["family"], next(iter(of["change"]))
    if family not in FAMILIES:
        raise InputError(f"{where} family is one of {', '.join(FAMILIES)}")
    if (family == "payload") != (first in PAYLOAD_STATES):
        raise InputError(f"{where} family is payload where {', '.join(PAYLOAD_STATES)} change")
    if family in ("health", "sensor") and first != "z":
        raise InputError(f"{where} family {family} changes z, and that first")
    if family == "sensor" and not of.get("sign", 0) > 0:
        raise InputError(f"{where} family sensor has sign 1")
