"""What makes all findings of a run doubtful: joints do not fail together.

Findings are mappings here, as `Finding.plain` gives them and findings.json has them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from urdyn.diagnose.findings.lossy_stream import silent

ANOTHER = (
    "current sensors of {} of {} joints do not fail at once: this is not this arm's twin, or "
    "currents are not in A; see to that before anything below"
)
FROM_THE_FIRST = (
    "{} of {} joints are far from this twin from the first sample on: it is another arm's, or out "
    "of date, or currents are not in A, or something pulls at the arm; see to that before anything "
    "below"
)
LOSSY = (
    "sensors of {} of {} joints do not fall silent at once: the stream has lost their values; "
    "see to the recorder and the network before anything below"
)
TURNED = (
    "the current of {} has the wrong sign, or is another joint's: no gain is off by "
    "{:.0f} %; see to the columns of the recording before anything below"
)
# No drive explains the currents of a joint with one of these: it is why a belief went astray.
MISLEADING = ("sensor_fault", "controller_instability")
GAIN = "gain of the current sensor"  # as named in the rules

ITS_TWIN = "make sure that this is this arm's twin before anything else; then "
ITS_COLUMNS = "see to the order and the signs of the columns before anything else; then "
ITS_STREAM = "see to the recorder and the network before anything else; then "

Findings = Collection[Mapping[str, Any]]


def doubt(findings: Findings, joints: int, restarts: int = 0) -> tuple[str, str]:
    """What to check before any of these, and how advice then begins; "" both if nothing.

    Where the currents were not this arm's for a while, so that a tracked belief was reset,
    `restarts` times, and no finding explains it, only the advice is changed.
    """
    if lost := _of_most(LOSSY, findings, joints, silently=True):
        return lost, ITS_STREAM
    another = _of_most(ANOTHER, findings, joints, silently=False)
    if another := another or _from_the_first(findings, joints):
        return another, ITS_TWIN
    if turned := _turned(findings):
        return turned, ITS_COLUMNS
    astray = restarts and not any(f["kind"] in MISLEADING for f in findings)
    return "", ITS_TWIN if astray else ""


def _turned(findings: Findings) -> str:
    """The text for a sensor that lost more than all of its gain; "" where none did."""
    gains = (f for f in findings if f["quantity"] == GAIN and f["size"] < -1.0)
    least = min(gains, key=lambda f: f["size"], default=None)
    return TURNED.format(least["name"], 100.0 * least["size"]) if least else ""


def _from_the_first(findings: Findings, joints: int) -> str:
    """The text where at least half of the joints were beyond every level from the start; or "".

    Sensors that fail together are reduced to warnings.
    """
    grave = (f for f in findings if f["severity"] == "critical" or f["kind"] == "sensor_fault")
    ill = {f["joint"] for f in grave if f.get("older")}
    return FROM_THE_FIRST.format(len(ill), joints) if ill and 2 * len(ill) >= joints else ""


def _of_most(said: str, findings: Findings, joints: int, silently: bool) -> str:
    """The text where sensors of most joints are, or are not, silent; "" for fewer."""
    faults = (f for f in findings if f["kind"] == "sensor_fault")
    ill = {f["joint"] for f in faults if silent(f["kind"], f.get("evidence", {})) is silently}
    return said.format(len(ill), joints) if 2 * len(ill) > joints else ""
