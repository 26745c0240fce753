"""The twin that a verb is to use, and what its file is if it is not a twin."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import urdyn as ud
from urdyn.errors import InputError, TwinError


def load_fit(twin: Path, others: Collection[str | Path]) -> ud.Fit:
    """The fit of a twin; InputError where it is not one but one of `others`, the logs, is."""
    try:
        return ud.Twin.load(twin).fit
    except TwinError:
        for other in others:
            if is_twin(Path(other)):
                told = f"{other} is a twin, and comes first; {twin} is to follow it"
                raise InputError(told) from None
        raise


def is_twin(path: Path) -> bool:
    """Whether a file claims to be a twin, valid or not."""
    from urdyn.io import load_toml

    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        return {"urdyn", "robot", "parameter"} <= load_toml(path).keys()
    except InputError:
        return False
