"""Spoken names of joints, links and quantities."""

from __future__ import annotations

from pathlib import PurePath

from urdyn.identify import Fit
from urdyn.model.drive import UNITS
from urdyn.report.digits import number
from urdyn.types import Source

MILLI = {"presliding_distance": "mrad"}  # quantities shown in thousandths, and their units

QUANTITIES = {
    "gain": "drive gain K",
    "coulomb": "Coulomb friction f",
    "viscous": "viscous damping α",
    "structural": "load friction β",
    "offset": "offset o",
    "rotor_inertia": "rotor inertia",
    "presliding_distance": "presliding distance",
    "presliding_tail": "presliding tail",
    "stribeck": "Stribeck friction g",
    "stribeck_velocity": "Stribeck velocity",
    "ripple_cos": "gear ripple, cosine",
    "ripple_sin": "gear ripple, sine",
    "thermal": "thermal damping",
}

TERMS = {"stribeck": "Stribeck", "ripple_cos": "gear ripple", "thermal": "thermal"}


def shown(quantity: str, unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity reads well; a ratio has no unit to show."""
    if quantity in MILLI:
        return 1e3, MILLI[quantity]
    return 1.0, "" if unit == "-" else unit


def capital(words: str) -> str:
    """Words with a capital first letter."""
    return f"{words[0].upper()}{words[1:]}"


def spoken(name: str) -> str:
    """The spoken name of a joint or link: "shoulder_pan_joint" is "shoulder pan".

    UR's URDF calls the base "base_link_inertia".
    """
    name = name.removesuffix("_inertia").removesuffix("_joint").removesuffix("_link")
    return name.replace("_", " ")


def joints(fit: Fit) -> list[str]:
    """The joints' spoken names, base first."""
    return [spoken(name) for name in fit.dynamics.arm.joint_names]


def terms(fit: Fit, joint: int) -> list[str]:
    """The optional terms of a joint's model, spoken."""
    words = TERMS | {"stribeck": _stribeck(fit, fit.dynamics.arm.joint_names[joint])}
    return [word for term, word in words.items() if term in fit.terms[joint]]


def _stribeck(fit: Fit, joint: str) -> str:
    """The friction that fades or builds up with speed, and the velocity by which most of it has."""
    size, speed = fit.value(f"{joint}.stribeck"), fit.value(f"{joint}.stribeck_velocity")
    units = UNITS["stribeck"], UNITS["stribeck_velocity"]
    word = TERMS["stribeck"] if size > 0.0 else "builds up by"
    return f"{word} {number(abs(size))} {units[0]}, {number(speed)} {units[1]}"


def title(source: Source) -> str:
    """A log's file name and slice."""
    name = PurePath(source.path).name or "unnamed log"
    return f"{name}, rows {source.rows[0]}:{source.rows[1]}" if source.rows else name


def robot(fit: Fit) -> str:
    """The arm's type as its maker writes it."""
    return maker(fit.dynamics.arm.name)


def maker(name: str) -> str:
    """An arm's type as its maker writes it: "ur10e" is "UR10e"."""
    return name.replace("ur", "UR", 1) if name.startswith("ur") else name
