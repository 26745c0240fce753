"""urdyn identify: recordings -> a twin, a URDF and a report."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from urdyn.cli.asked import asked, gains_of, loaded, overridden, read_as, tool_named, typed
from urdyn.cli.campaign import Campaign
from urdyn.cli.idle import idle
from urdyn.cli.options import (
    Columns,
    Contact,
    Folder,
    Gains,
    Json,
    Logs,
    Quiet,
    Rate,
    Robot,
    Rows,
    Unit,
)
from urdyn.cli.tool import remark
from urdyn.cli.voice import Voice

PayloadLogs = Annotated[
    list[Path] | None,
    typer.Option("--payload-log", metavar="LOG", help="Log of the arm with a payload; repeatable."),
]
Masses = Annotated[
    list[float] | None,
    typer.Option(
        "--payload-mass",
        metavar="KG",
        help="Mass of the payload in that log, in the same order; a known mass determines "
        "the drive gains, and where none is given it is estimated.",
    ),
]
PayloadRows = Annotated[
    str | None,
    typer.Option("--payload-rows", metavar="A:B", help="What --rows is, of the one --payload-log."),
]
ToolOption = Annotated[
    str | None,
    typer.Option(
        "--tool",
        metavar="KG,X,Y,Z",
        help="Mass of the tool that the arm bore in all logs, and its centre from the flange, in "
        "metres; 0: it bore none. Links then do not include it, and a payload that is tracked "
        "counts it.",
    ),
]

INFORMED = (
    "informed: how much of the published mass's uncertainty the data removed; from a fixed base no "
    "link can be weighed by itself\n"
)


def identify(
    context: typer.Context,
    logs: Logs,
    robot: Robot = None,
    out: Folder = None,
    columns: Columns = None,
    rows: Rows = None,
    rate: Rate = None,
    payload_log: PayloadLogs = None,
    payload_mass: Masses = None,
    payload_rows: PayloadRows = None,
    tool: ToolOption = None,
    drive_gain: Gains = None,
    effort_unit: Unit = None,
    contact: Contact = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find out what an arm is: masses, friction, damping, drive gains.

    LOG is a recording of the moving arm (CSV or Parquet with RTDE names, MCAP, a ROS bag), or a
    campaign.toml that names recordings and options.

    Example: [bold]urdyn identify run.csv --robot ur10e --out twin/[/bold]
    """
    campaign = overridden(
        asked(logs, robot, out),
        drive_gain=gains_of(drive_gain),
        tool=tool_named(tool),
        effort_unit=effort_unit,
    )
    if campaign.simulate is not None:
        own = ("columns", "rows", "rate", "payload_log", "payload_mass", "payload_rows")
        idle(context, "where the campaign simulates its arm", *own, "contact")
    payloads = loaded(campaign, payload_log, payload_mass)
    campaign = replace(
        campaign,
        logs=read_as(campaign.logs, columns, rows, rate, contact),
        payloads=read_as(payloads, columns, payload_rows, rate, contact),
        validate=read_as(campaign.validate, None, None, None, contact),
    )
    _run(campaign, Voice(json, quiet))


def _run(campaign: Campaign, voice: Voice) -> None:
    """Identify, save, print."""
    from urdyn.cli.carry_out import carry_out
    from urdyn.cli.results import FILES, require_folder, save
    from urdyn.cli.verdict import verdict
    from urdyn.report.identify.doubts import doubts
    from urdyn.report.identify.page import identify_page
    from urdyn.report.identify.summary import identified
    from urdyn.report.identify.tables import identify_table, validate_table

    require_folder(campaign.out)
    with voice.progress("reading") as progress:
        outcome = carry_out(campaign, progress)
        fit, scores = outcome.fit, outcome.scores
        doubted = doubts(fit, scores)
        page = identify_page(fit, scores, typed(), outcome.wall, outcome.truth, doubted)
        save(fit, page, campaign.out)
    voice.note(*outcome.defects)
    voice.show(identify_table(fit), INFORMED, validate_table(scores, fit), verdict(fit, scores))
    told = remark(campaign.tool, outcome.setting)
    voice.doubt(*doubted)
    voice.note(*_remarks(campaign), *filter(None, [told]))
    voice.note(f"written to {campaign.out}: {', '.join(FILES)}")
    voice.result(identified(fit, outcome.wall) | ({"doubts": doubted} if doubted else {}))


def _remarks(campaign: Campaign) -> list[str]:
    """What the estimates rest on."""
    if campaign.effort_unit == "Nm":
        whose = "given" if campaign.drive_gain else "typical of such joints"
        return [
            f"joint torques in N·m were divided by the drive gains {whose}, which are not sought"
        ]
    virtual = campaign.simulate and campaign.simulate.payload_mass
    if campaign.drive_gain or virtual or any(payload.mass for payload in campaign.payloads):
        return []
    return [
        "drive gains rest on what is typical of such joints, and so does the scale of all torques "
        "and masses: a log with a known payload (--payload-log, --payload-mass) would tell them"
    ]
