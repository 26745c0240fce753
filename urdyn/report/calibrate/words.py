"""What a calibration amounts to, in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.identify.kinematics import Evaluation
from urdyn.report.calibrate.summary import scores
from urdyn.report.digits import interval90, number
from urdyn.report.names import spoken
from urdyn.types import NORMAL90

MODELS = {
    "geometry": "geometry alone",
    "compliance": "geometry and the joints’ compliance",
    "transmission": "geometry, compliance and the joints’ error round a turn",
    "nominal": "the drawing",
    "geometry and joints": "geometry and what the joints do",
}
FINE = 1e-3  # [mm] below which a length is nothing
FINEST = 1e-4  # [mm, mrad] half width below which an interval counts as exact


def label(name: str) -> str:
    """A coordinate's spoken name: "elbow · a"."""
    joint, _, kind = name.rpartition(".")
    return f"{spoken(joint)} · {kind}"


def millimetres(value: float) -> str:
    """A length [mm] as people read it."""
    return "less than 0.001 mm" if value < FINE else f"{number(value)} mm"


def deviation(value: float, sd: float) -> str:
    """A coordinate and its 90 % interval [mm, mrad], to no more digits than are useful."""
    if NORMAL90 * sd < 1e-3 * FINEST:
        return f"{round(1e3 * value, 4) + 0.0:.4f}".replace("-", "−")
    return interval90(1e3 * value, 1e3 * sd)


def tool(summary: Mapping[str, Any]) -> str:
    """Where the tool, or the tracker's target, is on the flange."""
    if summary["tool_at_flange"]:
        return "The poses are the flange’s own: no tool offset is set."
    x, y, z = (f"{round(1e3 * v, 2) + 0.0:.2f}".replace("-", "−") for v in summary["tool"]["xyz_m"])
    return f"What was measured sits at x {x}, y {y}, z {z} mm on the flange."


def answer(summary: Mapping[str, Any]) -> str:
    """How good the calibration is, beside the drawing."""
    held = summary["held_out"][summary["model"]]
    words = (
        f"The calibrated arm explains the poses that it was fitted to, to "
        f"{millimetres(summary['rms_mm'])} RMS, the drawing to "
        f"{millimetres(summary['nominal_rms_mm'])}."
    )
    if summary["model"] != "geometry":
        alone = millimetres(summary["geometry_alone_rms_mm"])
        words += f" Geometry alone, which is all that other tools can use, comes to {alone}."
    worst, mean = millimetres(held["worst_mm"]), millimetres(held["rms_mm"])
    return f"{words} In regions that it has not seen it is off by {mean}, at worst {worst}."


def trust(summary: Mapping[str, Any]) -> str:
    """Where it holds, and why not where it does not."""
    expected = summary["expected_tcp_error_mm"]
    space = (
        f"All over the workspace the tool is expected {millimetres(expected['median'])} from where "
        f"it is predicted, {millimetres(expected['p95'])} in the worst twentieth; errors of the "
        "measurement count too, as poses cannot tell them from the arm's."
    )
    if summary["trusted_elsewhere"]:
        return space
    return f"{space} Do not trust it beyond these poses: {'; '.join(summary['reasons'])}."


def evaluated_answer(e: Evaluation) -> str:
    """How good an earlier calibration is here."""
    told = scores(e.fits[e.best], e.fits["nominal"], e.sound)
    parts = [
        f"{MODELS[name]} {millimetres(scores(fit, fit, e.sound)['rms_mm'])}"
        for name, fit in e.fits.items()
    ]
    gross = f", {told['gross']} gross errors apart" if told["gross"] else ""
    return (
        f"On these {told['n']:,} poses, base and tool fitted anew{gross}, RMS: {', '.join(parts)}."
    )
