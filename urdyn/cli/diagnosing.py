"""Diagnosis while a twin is tracked: its options, and its output on a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from urdyn.cli.voice import Voice
from urdyn.io.run_folder import quiet
from urdyn.report.finding_words import ahead, lasting

if TYPE_CHECKING:
    from urdyn.diagnose import Rules
    from urdyn.diagnose.onlooker import Onlooker
    from urdyn.identify import Fit
    from urdyn.io.helper import Helper
    from urdyn.tracking import Source

FAILED = 3  # exit status where a finding is to fail the run

NoDiagnosis = Annotated[bool, typer.Option("--no-diagnosis", help="Follow only, look for nothing.")]
RulesFile = Annotated[
    Path | None,
    typer.Option(
        "--rules", metavar="FILE", help="TOML of what is healthy and what is called a fault."
    ),
]
Hours = Annotated[
    float | None,
    typer.Option(
        "--false-alarm-hours",
        metavar="N",
        help="One false alarm of slow kinds in N hours of this robot at most, on the average; "
        "10,000 if not given.",
    ),
]
FailOnFinding = Annotated[
    bool,
    typer.Option(
        "--fail-on-finding",
        help="Exit with status 3 where a fault is found, neither acknowledged nor gone by now.",
    ),
]


def known_rules(path: Path | None, hours: float | None) -> Rules:
    """The rules of diagnosis that the options ask for."""
    from dataclasses import replace

    from urdyn.diagnose.kinds.rules_file import read_rules
    from urdyn.errors import InputError

    known = read_rules(path)
    if hours is None:
        return known
    if not 0.0 < hours < float("inf"):
        raise InputError(f"--false-alarm-hours {hours:g}: is to be above 0")
    return replace(known, hours=hours)


def onlooker(
    fit: Fit, source: Source, rules: Rules, voice: Voice, helper: Helper | None
) -> Onlooker:
    """A diagnosis beside the tracking, by `helper` if there is one, that reports its findings."""
    from urdyn.diagnose.onlooker import Onlooker

    def tell(finding: Mapping[str, Any]) -> None:
        voice.note(f"{finding['severity']}: {finding['kind']}: {finding['text']}")

    def retract(finding: Mapping[str, Any]) -> None:
        voice.note(f"taken back: {finding['kind']}: {finding['name']}: nothing of it is left")

    def warn(doubt: str) -> None:
        voice.note(f"doubt: {doubt}")

    origin = {"source": source.name, "source.sha256": source.sha256}
    return Onlooker(fit, source.period, rules, origin, tell, helper, retract, warn, source.live)


def undiagnosed(out: Path) -> None:
    """Remove an earlier diagnosis' findings from DIR: they are of another history."""
    from urdyn.diagnose.job import KEPT
    from urdyn.io.run_folder import FINDINGS

    for path in (out / FINDINGS, *out.glob(KEPT.format(index="*"))):
        path.unlink(missing_ok=True)


def faulty(summary: Mapping[str, Any]) -> bool:
    """Whether a fault was found that is not quiet."""
    return not all(map(quiet, summary.get("findings", ())))


def summed(summary: dict[str, Any]) -> str:
    """What was found, in lines."""
    found = summary.get("findings")
    if found is None:
        return "not diagnosed"
    if not found and not any(summary["quality"]["compared"]):
        return "not judged: no current was compared: that takes joints that move and their currents"
    arm = [f"health index of the arm: {lasting(summary['arm'])}"] if "arm" in summary else []
    judged = {joint["name"]: joint["judged"] for joint in summary.get("joints", ())}
    few = [name for name, told in judged.items() if not told]
    if 0 < len(few) < len(judged):
        arm.append(f"not judged: {', '.join(few)}: too little was seen, now or at commissioning")
    if not found:
        return "\n".join(["nothing found", *arm])
    doubt = [summary["doubt"]] if "doubt" in summary else []
    lines = doubt + [
        f"{f['severity']}: {f['kind']}: {f['text']} (sure {100 * f['confidence']:.0f} %)"
        + "".join(f", {words}" for words in [ahead(f)] if words)
        + (", acknowledged" if f["acknowledged"] else "")
        for f in found
    ]
    return "\n".join([*lines, *arm, f"recommended: {summary['recommendation']['text']}"])
