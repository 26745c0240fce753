"""The twin that a verb is to use, and what its file is if it is not a twin."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import urdyn as ud
from urdyn.errors import InputError


def load_fit(twin: Path, others: Collection[str | Path]) -> tuple[ud.Fit, str]:
    """The fit of a twin, and its file's sha256.

    Raises:
        InputError: it is not a twin but one of `others`, the logs, is; or it is being replaced.
    """
    from urdyn.io import sha256

    try:
        before, fit = sha256(twin), ud.Twin.load(twin).fit
    except InputError:
        for other in others:
            if is_twin(Path(other)):
                told = f"{other} is a twin, and comes first; {twin} is to follow it"
                raise InputError(told) from None
        raise
    if sha256(twin) != before:
        raise InputError(f"{twin}: was replaced while it was read; run again")
    return fit, before


def is_twin(path: Path) -> bool:
    """Whether a file claims to be a twin, valid or not."""
    from urdyn.io import load_toml

    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        return {"urdyn", "robot", "parameter"} <= load_toml(path).keys()
    except InputError:
        return False
