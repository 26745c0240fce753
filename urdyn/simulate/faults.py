"""Faults by name, as on the command line: KIND:joint=J,onset=S,rate=R,..."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, asdict, fields
from typing import Any, get_args, get_type_hints

import numpy as np

from urdyn.errors import InputError
from urdyn.simulate.mishaps import (
    Collision,
    EncoderOffset,
    PayloadChange,
    SensorFault,
    ThermalDrift,
)
from urdyn.simulate.wear import (
    ControllerInstability,
    FrictionIncrease,
    HealthDegradation,
    JointBacklash,
)

Fault = (
    FrictionIncrease
    | HealthDegradation
    | JointBacklash
    | ControllerInstability
    | PayloadChange
    | Collision
    | EncoderOffset
    | SensorFault
    | ThermalDrift
)

KINDS: Mapping[str, type[Fault]] = {
    "friction_increase": FrictionIncrease,
    "health_degradation": HealthDegradation,
    "joint_backlash": JointBacklash,
    "controller_instability": ControllerInstability,
    "payload_change": PayloadChange,
    "collision": Collision,
    "encoder_offset": EncoderOffset,
    "sensor_fault": SensorFault,
    "thermal_drift": ThermalDrift,
}

# The direction is implied by the fault's name; a negative value would be another event.
NOT_NEGATIVE = {"onset", "viscous", "delay", "mass"}
GROWING = (FrictionIncrease, HealthDegradation, JointBacklash, ControllerInstability)
CHANGES = {"rate", "offset", "delay", "force"}  # size of a fault


def parse_fault(text: str, joints: int) -> Fault:
    """The fault that a text describes, for an arm with `joints`; InputError says what is wrong.

    Vectors are written with slashes: `payload_change:onset=60,mass=1.5,com=0/0/0.05`.
    """
    kind, _, rest = text.partition(":")
    if kind not in KINDS:
        raise InputError(f"fault {text!r}: no kind {kind!r}; name one of {', '.join(KINDS)}")
    try:
        return _checked(KINDS[kind](**_values(KINDS[kind], rest)), joints)
    except InputError as error:
        raise InputError(f"fault {text!r}: {error}") from None


def describe(fault: Fault) -> dict[str, Any]:
    """The fault as a table: its kind, then its fields; infinite ones are left out."""
    kind = next(name for name, of in KINDS.items() if isinstance(fault, of))
    return {"kind": kind} | {k: v for k, v in asdict(fault).items() if v != float("inf")}


def _values(kind: type[Fault], text: str) -> dict[str, Any]:
    """Fields of a kind by name, from "joint=2,rate=0.001"."""
    known = {field.name: field for field in fields(kind)}
    hints = get_type_hints(kind)
    values: dict[str, Any] = {}
    for word in filter(None, text.split(",")):
        name, equals, value = (part.strip() for part in word.partition("="))
        if not equals or name not in known or name in values:
            what = f"{name} is given twice" if name in values else f"no field {name!r}"
            raise InputError(f"{what}; write {', '.join(f'{n}=...' for n in known)}")
        values[name] = _value(name, value, hints[name])
    if missing := [n for n, field in known.items() if n not in values and _needed(field)]:
        raise InputError(f"needs {' and '.join(missing)}")
    far = [name for name in known if name in CHANGES]
    if far and not any(name in values for name in far):  # an explicit 0 is allowed, as a control
        raise InputError(f"needs {' or '.join(far)}")
    return values


def _needed(field: Field[Any]) -> bool:
    return field.default is MISSING


def _value(name: str, text: str, hint: Any) -> Any:
    """One value: a number, a vector X/Y/Z, or one of a few words."""
    words = get_args(hint)
    if words and isinstance(words[0], str):
        if text not in words:
            raise InputError(f"{name}={text}: is one of {', '.join(words)}")
        return text
    try:
        if not words:
            return hint(text)
        x, y, z = map(float, text.split("/"))
    except ValueError:
        form = "three numbers X/Y/Z" if words else f"a {'whole ' * (hint is int)}number"
        raise InputError(f"{name}={text}: is {form}") from None
    return x, y, z


def _checked(fault: Fault, joints: int) -> Fault:
    """The fault, if an arm with this number of joints can have it."""
    usual = {field.name: field.default for field in fields(fault)}  # some defaults are infinite
    never_below = NOT_NEGATIVE | ({"rate"} if isinstance(fault, GROWING) else set())
    for name, value in asdict(fault).items():
        numbers = () if isinstance(value, str) else np.atleast_1d(value)
        if name in ("joint", "link") and not 0 <= value < joints:
            raise InputError(f"{name}={value}: {name}s count from 0 to {joints - 1}")
        if not np.isfinite(numbers).all() and value != usual[name]:
            raise InputError(f"{name}={value}: is to be finite")
        if name == "duration" and value <= 0.0:
            raise InputError(f"{name}={value:g}: is to be above 0")
        if name in never_below and value < 0.0:
            raise InputError(f"{name}={value:g}: is not to be negative")
    return fault
