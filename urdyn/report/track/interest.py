"""Quantities of interest: margins, power and what the model still misses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.digits import MISSING, interval90, number, percent
from urdyn.report.markup import Html, cell, paragraph, section, table, text
from urdyn.report.names import spoken
from urdyn.types import NORMAL90

HEAD = (
    "",
    "torque margin",
    "drive power",
    "lost to friction",
    "prediction error",
    "as commissioned",
)


def interest(quantities: Mapping[str, Any]) -> Html:
    """A table over the joints, and how much more the arm could carry."""
    return section(
        "Margins, power, prediction",
        "Torque margin: share of a healthy drive’s torque that was unused at the hardest moment. "
        "Drive power: mechanical, while the drive drove the joint, averaged over the run. "
        "Friction also dissipates what gravity, inertia and other joints supply while the drive "
        "brakes, so it may take more than the drive gave. "
        "Prediction error: r.m.s. error of the current by the model as it was tracked, relative to "
        "the current; beside it that of the model as commissioned.",
        paragraph(_carries(quantities)),
        table(HEAD, [_row(joint) for joint in quantities["joints"]]),
    )


def _carries(quantities: Mapping[str, Any]) -> str:
    """What more the arm could carry, and whether its joints or its rating end it."""
    margin, torque = quantities["payload_margin_kg"], _more(quantities["torque_payload_margin_kg"])
    joints = f"On these motions the joints could carry {torque} kg more"
    if margin["by"] is None or margin["sd"] is None:
        return "No motion has shown yet what more the arm could carry."
    if margin["by"] == "torque":
        return f"{joints}."
    if margin["value"] < -NORMAL90 * margin["sd"]:
        over = interval90(-margin["value"], margin["sd"])
        return f"The arm carries {over} kg more than it is rated for."
    if margin["value"] < 0.0:
        return "By its rating the arm may carry no more."
    beyond = f" {joints}, which its maker does not allow." if torque else ""
    return f"By its rating the arm may carry {_more(margin)} kg more.{beyond}"


def _more(margin: Mapping[str, float | None]) -> str:
    value, sd = margin["value"], margin["sd"]
    return "" if value is None or sd is None else interval90(value, sd)


def _row(joint: Mapping[str, Any]) -> list[Html]:
    margin, sd = joint["torque_margin"], joint["torque_margin_sd"]
    return [
        text(spoken(joint["name"])),
        cell(percent(margin), f"± {percent(NORMAL90 * sd)}"),
        cell(f"{number(joint['power_W'])} W"),
        cell(f"{number(joint['friction_power_W'])} W"),
        cell(_share(joint["rre_percent"])),
        cell(_share(joint["commissioned_rre_percent"])),
    ]


def _share(value: float | None) -> str:
    return MISSING if value is None else percent(value / 100.0)
