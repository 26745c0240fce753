"""The payload set in the controller, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import fixed


def set_to(setting: Mapping[str, Any] | None) -> str:
    """A setting beside the tracked load, from `compared`; "" where there is none."""
    if setting is None:
        return ""
    told, off = f"the controller is set to {fixed(setting['mass_kg'], 2)} kg", setting["off_kg"]
    if off is None:
        return told
    least = "" if setting["tool_known"] else "at least "
    return f"{told}: {least}{fixed(abs(off), 2)} kg too {'little' if off > 0.0 else 'much'}"
