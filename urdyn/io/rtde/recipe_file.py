"""Recipes in files: UR's record_configuration.xml, or one name per line."""

from __future__ import annotations

from codecs import BOM_UTF8
from pathlib import Path
from xml.parsers import expat

from urdyn.errors import InputError
from urdyn.io.rtde.fields import TYPES

LARGEST = 1 << 20  # [bytes]: no recipe is as long as this


def read_recipe(path: str | Path, key: str = "out") -> tuple[str, ...]:
    """Names that a recipe file asks for; of an XML file the recipe `key`.

    Types in an XML file have to be RTDE's; the controller decides which one a variable has.
    """
    try:
        text = Path(path).read_bytes().removeprefix(BOM_UTF8)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if len(text) > LARGEST:
        raise InputError(f"{path}: is no recipe: more than {LARGEST >> 20} MB")
    names = _xml(text, key, path) if text.lstrip().startswith(b"<") else _plain(text, path)
    if not names:
        raise InputError(f"{path}: names no variable; write one a line, such as actual_q")
    return tuple(dict.fromkeys(names))


def _plain(text: bytes, path: str | Path) -> list[str]:
    """One name per line, or parted by commas; # begins a comment, in whatever encoding."""
    names = b"\n".join(line.partition(b"#")[0] for line in text.splitlines())
    try:
        return names.decode("ascii").replace(",", " ").split()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is neither a list of RTDE names nor XML") from error


def _xml(text: bytes, key: str, path: str | Path) -> list[str]:
    """<rtde_config><recipe key="out"><field name="actual_q" type="VECTOR6D"/>..."""
    names: list[str] = []
    keys: list[str] = []
    inside = False

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal inside
        if tag == "recipe":
            keys.append(attributes.get("key", ""))
            inside = keys[-1] == key
        elif tag == "field" and inside:
            names.append(_name(attributes, path))

    def refuse(*_: object) -> None:  # its entities may grow without bound, or fetch
        raise InputError(f"{path}: has a DOCTYPE; a recipe needs none, take it out")

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}:{error.lineno}: is not XML: {error}") from error
    if keys and key not in keys:
        raise InputError(f"{path}: has no recipe {key!r}, but {', '.join(map(repr, keys))}")
    return names


def _name(attributes: dict[str, str], path: str | Path) -> str:
    """The variable that a field element asks for."""
    name, type_ = attributes.get("name", "").strip(), attributes.get("type", "")
    if not name or "," in name:
        raise InputError(f"{path}: has a field without a name")
    if type_ and type_ not in TYPES:
        raise InputError(f"{path}: {name} has type {type_}; RTDE has {', '.join(TYPES)}")
    return name
