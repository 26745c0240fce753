"""What the controller is set to carry, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import fixed
from urdyn.tracking.setting import tolerance

TELL = "tell the controller what the tool weighs"  # as the rules advise of another payload
MEANT = "see that this load is meant"


def advised(summary: dict[str, Any]) -> dict[str, Any]:
    """A diagnosed run that does not advise to tell the controller what it is set to already."""
    if "findings" not in summary or not _agrees(summary):
        return summary
    findings = [f | {"advice": f["advice"].replace(TELL, MEANT)} for f in summary["findings"]]
    said = summary["recommendation"]
    said = said | {"text": said["text"].replace(TELL, MEANT)}
    return {**summary, "findings": findings, "recommendation": said}


def _agrees(summary: Mapping[str, Any]) -> bool:
    """Whether the controller is set to the load that is tracked, within what is known of it."""
    setting = summary.get("payload_setting")
    if setting is None or not setting["tool_known"]:
        return False
    load = summary["final"]["payload.mass"]
    off = abs(load["mean"] - setting["mass_kg"])
    return bool(off <= tolerance(load["sd"]))


def set_to(setting: Mapping[str, Any] | None) -> str:
    """A setting beside the load that is tracked, of `compared`; "" where nobody said any."""
    if setting is None:
        return ""
    told, off = f"the controller is set to {fixed(setting['mass_kg'], 2)} kg", setting["off_kg"]
    if off is None:
        return told
    least = "" if setting["tool_known"] else "at least "
    return f"{told}: {least}{fixed(abs(off), 2)} kg too {'little' if off > 0.0 else 'much'}"
