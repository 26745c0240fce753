"""What a tracked stream lacked, and how much of it a run could use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from urdyn.io.spans import clock
from urdyn.report.digits import number, percent
from urdyn.report.markup import Html, cell, paragraph, section, table, text
from urdyn.report.names import spoken
from urdyn.report.track.history import History
from urdyn.types import MAD_TO_SD

WILD = 4.0  # [-] standard deviations of a residual from its middle, beyond which it is counted
LEAD = (
    "Nothing is filtered before it is compared, and nothing is filled in. Compared: rows of the "
    "history in which the joint slid, its presliding was known, and its current was one that the "
    "drive can have; nothing is learnt from the others. Outliers: compared rows more than four "
    "robust standard deviations off, where a Gaussian has 0.006 %; they are weighted down."
)


def quality(history: History, summary: Mapping[str, Any]) -> Html:
    """Losses of the stream, and how each joint's samples were used."""
    lacked = summary["quality"]
    heads = ["joint", "without current", "compared", "outliers", "residual, robust sd"]
    rows = [
        [text(spoken(joint)), _missing(lacked["without_current"][j]), *_used(history, joint)]
        for j, joint in enumerate(history.joints)
    ]
    defects = "; ".join(lacked["defects"]) or "none"
    return section(
        "Data quality",
        LEAD,
        table(["of the stream", "count", ""], _stream(summary, lacked)),
        paragraph(f"Damage met while reading: {defects}.", "note"),
        *_too_sparse(history, lacked["too_sparse"]),
        table(heads, rows),
    )


def _stream(summary: Mapping[str, Any], lacked: Mapping[str, Any]) -> list[list[Html]]:
    step = lacked["longest_step_s"]
    longest = f"longest step {clock(step)(step)}"
    counts = {
        "samples": (summary["samples"], clock(summary["data_s"])(summary["data_s"])),
        "gaps": (lacked["gaps"], f"of more than five periods; {longest}"),
        "samples missing in gaps": (lacked["missing"], ""),
        "repeated stamps": (lacked["repeated"], "left out"),
        "clock set": (lacked["clock_set"], "started again there"),
        "angles and speeds refused": (lacked["refused"], "impossible for this arm"),
        "currents left out": (lacked["undrawn"], "more than a motor draws"),
        "moved by hand, or without power": (lacked["undriven"], "their currents left out"),
        "in contact": (lacked["in_contact"], "their currents left out"),
        "speeds that stood still": (
            sum(joint["samples"] for joint in lacked["frozen"]),
            "while their joint moved; angles alone were used",
        ),
        "currents that stood still": (sum(lacked["stuck"]), "while their joint moved; left out"),
        "estimates reset": (lacked["restarts"], "their drive parameters were impossible"),
    }
    return [
        [text(name), cell(f"{count:,}", kind=_kind(name, count)), text(remark)]
        for name, (count, remark) in counts.items()
    ]


def _too_sparse(history: History, sparse: Mapping[str, float] | None) -> list[Html]:
    """That for some time samples came too seldom to track anything."""
    if sparse is None:
        return []
    time = history.clock
    told = (
        f"From {time(sparse['since'] - history.start)} on, for {time(sparse['for_s'])}, samples "
        f"came {number(sparse['step_s'])} s apart, where {number(sparse['period_s'])} s had been "
        "expected: nothing was tracked then."
    )
    return [paragraph(told, "note")]


def _kind(name: str, count: int) -> str:
    return "outside" if count and name != "samples" else ""


def _missing(share: float) -> Html:
    return cell(f"{number(100.0 * share)} %", kind="outside" if share else "")


def _rows(count: int) -> str:
    return f"{count:,} row{'' if count == 1 else 's'}"


def _used(history: History, joint: str) -> list[Html]:
    current, predicted = history.currents(joint)
    left = current - predicted
    told = left[np.isfinite(left)]
    if not len(told):
        return [cell(percent(0.0)), cell("–"), cell("–")]
    middle = float(np.median(told))
    sd = MAD_TO_SD * float(np.median(np.abs(told - middle)))
    wild = np.abs(told - middle) > WILD * sd
    return [
        cell(percent(len(told) / len(left))),
        cell(f"{number(100.0 * float(wild.mean()))} %", _rows(int(wild.sum()))),
        cell(f"{number(sd)} A"),
    ]
