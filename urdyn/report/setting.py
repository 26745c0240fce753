"""The payload set in the controller, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import fixed
from urdyn.tracking.belief.payload_holds import SIDES


def set_to(setting: Mapping[str, Any] | None) -> str:
    """A setting beside the tracked load, from `compared`; "" where there is none."""
    if setting is None:
        return ""
    told, off = f"the controller is set to {fixed(setting['mass_kg'], 2)} kg", setting["off_kg"]
    least = "" if setting["tool_known"] else "at least "
    if off is not None:
        told += f": {least}{fixed(abs(off), 2)} kg too {'little' if off > 0.0 else 'much'}"
    return "; ".join([told, *_hold_by_hold(setting["holds"], least)])


def _hold_by_hold(holds: Mapping[str, Any], least: str) -> list[str]:
    """What was set wrong too often to be chance, such as "too little in 10 of 10 holds"."""
    return [
        f"the setting was {words} in {side['holds']} of {holds['judged']} holds, on average "
        f"{fixed(side['set_kg'], 2)} kg for {least}{fixed(side['carried_kg'], 2)} kg"
        for words, side in ((name.replace("_", " "), holds[name]) for name in SIDES)
        if side["sure"]
    ]
