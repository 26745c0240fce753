"""An arm with other inertials as a URDF: its own file with the <inertial> elements rewritten."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import Any

import numpy as np
import pinocchio as pin

from urdyn.errors import ArmError
from urdyn.model.arm import Arm
from urdyn.model.chain import parse, read_chain
from urdyn.model.consistency import is_consistent
from urdyn.types import Array


def describe(arm: Arm, inertials: Array, provenance: str = "") -> str:
    """The URDF of `arm` with `inertials` (J, 10): a file that loads with exactly these.

    What is bolted to a moving link is part of its body: the link gets the body's inertia and its
    attachments none. Links before the first joint keep theirs. `provenance` heads the file.
    """
    root = parse(arm.urdf)
    links = {link.get("name"): link for link in root.findall("link")}
    for body, parameters in zip(read_chain(root).bodies, inertials, strict=True):
        if not is_consistent(parameters):
            raise ArmError(f"link {body[0]!r} cannot be written: no solid body has its inertials")
        moving, *bolted = (links[name] for name in body)
        _set_inertial(moving, pin.Inertia.FromDynamicParameters(parameters))
        for link in filter(len, bolted):  # an empty link is a frame, without any inertia
            # Zero, not absent: without an <inertial> MuJoCo weighs a link by its shape.
            _set_inertial(link, pin.Inertia.Zero())
    ET.indent(root)
    comment = f"<!-- {_speakable(provenance)} -->\n" if provenance else ""
    return f'<?xml version="1.0"?>\n{comment}{ET.tostring(root, encoding="unicode")}\n'


def _set_inertial(link: ET.Element, inertia: Any) -> None:
    """Give `link` Pinocchio's `inertia`: about the centre of mass, in the axes of the link."""
    for old in link.findall("inertial"):
        link.remove(old)
    inertial = ET.Element("inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(inertia.lever), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_numbers([inertia.mass]))
    rows, columns = np.triu_indices(3)
    values = inertia.inertia[rows, columns]
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    ET.SubElement(inertial, "inertia", dict(zip(names, map(repr, values.tolist()), strict=True)))
    link.insert(0, inertial)


def _numbers(values: Iterable[float]) -> str:
    """Text that reads back as the same doubles."""
    return " ".join(repr(float(value)) for value in values)


def _speakable(text: str) -> str:
    """`text` as XML allows it in a comment: printable, no two hyphens in a row."""
    printable = "".join(letter for letter in text if letter.isprintable() or letter == "\n")
    return re.sub(r"-(?=-)", "- ", printable)
