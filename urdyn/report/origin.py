"""Where the numbers come from: the logs, their noise, and how to make the page again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify import Fit, Noise, Score
from urdyn.identify.noise import GAUSSIAN
from urdyn.report.digits import number, percent
from urdyn.report.evidence import residual, seen
from urdyn.report.markup import Html, cell, section, table, tag, text
from urdyn.report.names import joints, title
from urdyn.signal.stretches import breaks
from urdyn.types import Log
from urdyn.version import __version__

WILD = 4.0  # [-] standard deviations of a residual, beyond which it is counted


def data_quality(fit: Fit, scores: Sequence[Score]) -> Html:
    """Quality of the logs, and how current scatters around the model."""
    return section(
        "Data and noise",
        "Damage was met while reading and is listed. Noise is autoregressive: the next sample’s "
        "error is partly predicted by the last ones, so parameters are less sure than with white "
        "noise.",
        table(
            [
                "log",
                "",
                "rows",
                "duration",
                "mean rate",
                "gaps",
                "without current",
                "beyond 4 sd",
                "defects",
            ],
            [_log(fit, s) for s in scores],
            "words",
        ),
        table(["joint", "noise", "memory", "tails", "coefficients"], _noise(fit), "words"),
    )


def _log(fit: Fit, score: Score) -> list[Html]:
    log = score.log
    missing = 1.0 - float(np.isfinite(log.joint("actual_current")).all(axis=1).mean())
    return [
        text(title(log.source)),
        text(seen(fit, log.source)),
        text(f"{len(log):,}"),
        text(f"{number(score.duration, 3)} s"),
        text(f"{number((len(log) - 1) / score.duration, 3)} Hz"),  # not by the usual step
        text(_gaps(log)),
        text("none" if missing == 0.0 else percent(missing)),
        text(_wild(fit, score)),
        text("; ".join(map(str, log.defects)) or "none"),
    ]


def _gaps(log: Log) -> str:
    """Times without a row, longer than a few usual steps."""
    count = len(breaks(log.t))
    return f"{count}, the longest {number(float(np.diff(log.t).max()))} s" if count else "none"


def _wild(fit: Fit, score: Score) -> str:
    """Currents that are far off, which the Student t weights less."""
    left = np.abs(residual(score)) / fit.noise.sd
    return _counted(int((left > WILD).sum()), int(np.isfinite(left).sum()))


def _counted(count: int, whole: int) -> str:
    """A count, and its share unless it is 0."""
    return f"{count:,} ({number(100.0 * count / whole)} %)" if count else "none"


def _noise(fit: Fit) -> list[list[Html]]:
    return [
        [text(name), text(f"{number(float(fit.noise.sd[j]))} A"), *_colour(fit.noise, j)]
        for j, name in enumerate(joints(fit))
    ]


def _colour(noise: Noise, j: int) -> list[Html]:
    ar, dof = np.trim_zeros(noise.ar[j], "b"), float(noise.dof[j])
    explained = 1.0 - float(noise.scale[j] ** 2 * dof / (dof - 2.0) / noise.sd[j] ** 2)
    memory = (
        f"order {len(ar)}, predicts {percent(max(explained, 0.0))} of the next sample"
        if len(ar)
        else "none, white"
    )
    tails = "Gaussian" if dof >= GAUSSIAN else f"Student t, {number(dof)} degrees of freedom"
    return [text(memory), text(tails), cell(", ".join(number(a) for a in ar) or "–", kind="hash")]


def provenance(fit: Fit, command: str, facts: dict[str, str]) -> Html:
    """Version, hashes and the command line."""
    rows = [
        [text(title(source)), tag("span", text(source.sha256 or "not from a file"), kind="hash")]
        for source in fit.sources
    ]
    told = {"urdyn": __version__, "samples": f"{fit.n_samples:,}"} | facts
    drive = fit.dynamics.drive
    lead = "current leads the recorded motion by"
    told[lead] = f"{number(1e3 * drive.time_offset)} ms"
    if "time_offset" in fit.parameters.names:  # in older twins it was given
        told[lead] += f" (sd {number(1e3 * fit.spread('time_offset'))} ms)"
    told["friction reverses before that by"] = f"{number(1e3 * drive.friction_lead)} ms"
    return section(
        "Provenance",
        " · ".join(f"{key} {value}" for key, value in told.items()),
        table(["training log", "SHA-256"], rows, "words"),
        *again(command),
    )


def again(command: str) -> list[Html]:
    """How to make the page again."""
    return [tag("p", text("To reproduce:")), tag("pre", tag("code", text(command)))]
