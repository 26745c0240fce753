"""Parameters of interest by name: "payload", "elbow friction", "gains", "forearm mass"."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

from urdyn.errors import InputError
from urdyn.identify.unknowns import COORDINATES

FRICTION = ("coulomb", "viscous", "structural", "stribeck")
QUANTITIES = {
    "friction": FRICTION,
    "damping": ("viscous",),
    "gain": ("gain",),
    "gains": ("gain",),
    "offset": ("offset",),
    "rotor": ("rotor_inertia",),
    "mass": ("alpha",),
    "centre": ("t1", "t2", "t3"),
    "body": COORDINATES,
}


def interesting(names: Sequence[str], phrases: Sequence[str]) -> list[int]:
    """Indices among `names` of the unknowns that phrases ask for; InputError for a phrase without.

    A phrase is a joint, a link or the payload, a quantity, or one of each: "elbow friction".
    """
    places = {k for phrase in phrases for k in _places(names, phrase)}
    return sorted(places)


def of_payload(phrases: Sequence[str]) -> bool:
    """Whether one of the phrases asks for a payload."""
    return any("payload" in phrase.lower() for phrase in phrases)


def _places(names: Sequence[str], phrase: str) -> list[int]:
    """Indices that one phrase asks for."""
    owner, fields = _parsed(names, phrase)
    parts = [name.rpartition(".") for name in names]
    own = {k: field for k, (body, _, field) in enumerate(parts) if owner in ("", _spoken(body))}
    found = [k for k, field in own.items() if not fields or field in fields]
    if not found:
        has = ", ".join(name for name, of in QUANTITIES.items() if {*of} & {*own.values()})
        raise InputError(f"of interest: {phrase!r}: {owner or 'such an arm'} has only {has}")
    return found


def _parsed(names: Sequence[str], phrase: str) -> tuple[str, set[str]]:
    """Owner and fields that a phrase names; empty where it names none."""
    words = phrase.lower().replace("_", " ").split()
    fields = {field for word in words for field in QUANTITIES.get(word, ())}
    owner = " ".join(word for word in words if word not in QUANTITIES)
    if not words or (owner and owner not in _owners(names)):
        known = sorted({*_owners(names), *QUANTITIES})
        close = get_close_matches(owner, known, 1)
        hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
        raise InputError(f"of interest: {phrase!r} is nothing that is unknown; {hint}")
    return owner, fields


def _owners(names: Sequence[str]) -> set[str]:
    return {_spoken(name.rpartition(".")[0]) for name in names if "." in name}


def _spoken(body: str) -> str:
    """ "elbow_joint" is "elbow", "forearm_link" is "forearm", "payload_0" is "payload"."""
    plain = body.removesuffix("_joint").removesuffix("_link").removesuffix("_0")
    return plain.replace("_", " ")
