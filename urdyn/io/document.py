"""TOML documents: read with the line that is to blame, written with one matrix row per line.

tomli-w would write every number of a matrix on a line of its own, which makes a twin's covariance
some thousand lines that nobody can read or compare; hence the small writer here.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from urdyn.errors import InputError

BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def load_toml(path: str | Path, error: type[InputError] = InputError) -> dict[str, Any]:
    """The document in `path`; whatever is wrong with it is an `error` that names file and line."""
    try:
        return tomllib.loads(Path(path).read_bytes().decode("utf-8-sig"))
    except IsADirectoryError as cause:
        like = next((f", like {file}" for file in sorted(Path(path).glob("*.toml"))), "")
        raise error(f"{path}: is a folder; name a file in it{like}") from cause
    except OSError as cause:
        raise error(f"{path}: cannot be read: {cause.strerror}") from cause
    except UnicodeDecodeError as cause:
        line = cause.object[: cause.start].count(b"\n") + 1
        raise error(f"{path}:{line}: not UTF-8 text") from cause
    except (ValueError, RecursionError) as cause:  # numbers too long, tables nested too deep
        place = re.search(r" \(at line (\d+), column \d+\)", str(cause))
        where = f"{path}:{place[1]}" if place else str(path)
        reason = str(cause).replace(place[0], "") if place else str(cause)
        raise error(f"{where}: not TOML: {reason}") from cause


def dump_toml(document: Mapping[str, Any]) -> str:
    """TOML text of nested mappings of str, bool, int, float, arrays and lists of these.

    Floats are written so that they read back bit for bit; tables in a list become `[[name]]`.
    """
    return "\n".join(_table(document, ())).strip("\n") + "\n"


def _table(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Lines of one table: plain keys first, as TOML demands, then the tables inside it."""
    lines = [f"{_key(k)} = {_value(v)}" for k, v in table.items() if not _nested(v)]
    for key, value in table.items():
        if not _nested(value):
            continue
        inner = (*path, key)
        name = ".".join(map(_key, inner))
        if isinstance(value, Mapping):
            lines += ["", f"[{name}]", *_table(value, inner)]
        else:
            for item in value:
                lines += ["", f"[[{name}]]", *_table(item, inner)]
    return lines


def _nested(value: object) -> bool:
    """Is `value` a table, or a list of nothing but tables?"""
    if isinstance(value, list | tuple):
        return bool(value) and all(isinstance(item, Mapping) for item in value)
    return isinstance(value, Mapping)


def _key(key: str) -> str:
    return key if BARE_KEY.fullmatch(key) else _string(key)


def _string(text: str) -> str:
    # JSON's escapes are TOML's, except that TOML wants DEL escaped too.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object) -> str:
    match value:
        case str():
            return _string(value)
        case bool() | np.bool_():
            return str(bool(value)).lower()
        case int() | np.integer():
            return str(int(value))
        case float() | np.floating():
            return repr(float(value))
        case np.ndarray():
            return _value(value.tolist())
        case list() | tuple():
            return _array(value)
        case _:
            raise TypeError(f"TOML has no {type(value).__name__}")


def _array(items: list[Any] | tuple[Any, ...]) -> str:
    """A row on one line, a matrix with one row per line."""
    texts = [_value(item) for item in items]
    if any(isinstance(item, list | tuple | np.ndarray) for item in items):
        return "[\n" + "".join(f"  {text},\n" for text in texts) + "]"
    return f"[{', '.join(texts)}]"
