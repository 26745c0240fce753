"""The self-contained pages of a calibration, and of its score on other poses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from urdyn.identify.kinematics import Calibration, Evaluation
from urdyn.report.calibrate.doubts import doubts
from urdyn.report.calibrate.joints import joints_section
from urdyn.report.calibrate.parameters import parameters_section
from urdyn.report.calibrate.residuals import residuals_section
from urdyn.report.calibrate.space import bars, models_key, space_section
from urdyn.report.calibrate.words import answer, evaluated_answer, tool, trust
from urdyn.report.digits import number
from urdyn.report.markup import (
    Html,
    document,
    facts,
    join,
    paragraph,
    plot,
    section,
    table,
    tag,
    text,
)
from urdyn.report.names import maker
from urdyn.report.origin import again
from urdyn.version import __version__


def calibrate_page(c: Calibration, summary: Mapping[str, Any], command: str) -> str:
    """HTML of a calibration that `command` makes; `summary` is what `--json` prints."""
    name = maker(c.arm.name)
    return document(
        f"{name} calibrated",
        join(
            [
                tag("h1", text(f"{name} · calibrated geometry")),
                paragraph(answer(summary), "headline"),
                paragraph(trust(summary), "lead" if c.verdict.trusted else "lead outside"),
                paragraph(tool(summary), "lead"),
                space_section(c, summary),
                facts(_about(summary)),
            ]
        ),
        parameters_section(c),
        *([joints_section(c)] if len(c.found.placement.coefficients) else []),
        doubts(c, summary),
        residuals_section(c.found.residuals, c.sound, c.poses.q, c.arm.joint_names),
        _provenance(summary, command),
    )


def evaluate_page(e: Evaluation, summary: Mapping[str, Any], folder: Path, command: str) -> str:
    """HTML of a calibration's score on other poses."""
    name, found = maker(e.arm.name), e.fits[e.best]
    errors = {model: told["rms_mm"] for model, told in summary["models"].items()}
    return document(
        f"{name} calibration scored",
        join(
            [
                tag("h1", text(f"{name} · calibration of {folder.name} scored")),
                paragraph(evaluated_answer(e), "headline"),
                plot(bars(errors), "Error by model", "RMS of place", models_key(errors)),
                facts(_about(summary)),
            ]
        ),
        residuals_section(found.residuals, e.sound, e.poses.q, e.arm.joint_names),
        _provenance(summary, command),
    )


def _about(summary: Mapping[str, Any]) -> dict[str, str]:
    turn = summary["rms_mrad"]
    return {
        "poses": f"{summary['n']:,}",
        "gross errors": f"{summary['gross']:,}",
        "95 % within": f"{number(summary['p95_mm'])} mm",
        "turn": f"{number(turn)} mrad RMS" if turn is not None else "not measured",
        "rank": f"{summary['rank']} of {summary['n_parameters']}",
        "fitted in": f"{number(summary['wall_s'])} s",
    }


def _provenance(summary: Mapping[str, Any], command: str) -> Html:
    source = summary["source"]
    rows = [
        [text(source["path"]), tag("span", text(source["sha256"]), kind="hash")],
        *([text("left out"), text(defect)] for defect in summary["defects"]),
    ]
    return section(
        "Provenance",
        f"urdyn {__version__} · {summary['robot']} · model: {summary['model']}",
        table(["poses", "SHA-256"], rows, "words"),
        *again(command),
    )
