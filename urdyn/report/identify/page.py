"""The self-contained page of an identification, and of a validation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from urdyn.identify import Fit, Score
from urdyn.report.digits import number
from urdyn.report.identify.comparison import Truth
from urdyn.report.identify.friction_section import friction_section
from urdyn.report.identify.headline import headline
from urdyn.report.identify.identifiability import identifiability
from urdyn.report.identify.masses import masses
from urdyn.report.identify.prediction import judged
from urdyn.report.identify.truth_section import truth_section
from urdyn.report.markup import document
from urdyn.report.names import robot
from urdyn.report.origin import data_quality, provenance


def identify_page(
    fit: Fit,
    scores: Sequence[Score],
    command: str,
    wall: float,
    truth: Truth | None = None,
    doubts: Sequence[str] = (),
) -> str:
    """HTML of an identification.

    Args:
        scores: on the training logs, and on logs held out if there are any.
        command: the command line that makes it again.
        wall: time that the identification took [s].
        truth: of `urdyn.simulate.truth`, where the arm is simulated.
        doubts: reasons to doubt the fit, in sentences.
    """
    took = {"identified in": f"{number(wall)} s"}
    return document(
        f"{robot(fit)} identified",
        headline(fit, scores, "identified dynamics", _facts(fit) | took, doubts),
        *([truth_section(fit, truth)] if truth else []),
        judged(fit, scores),
        friction_section(fit, scores, truth),
        masses(fit, truth),
        identifiability(fit, scores),
        data_quality(fit, scores),
        provenance(fit, command, took),
    )


def validate_page(
    fit: Fit, scores: Sequence[Score], command: str, doubts: Sequence[str] = ()
) -> str:
    """HTML of a validation: how well a fit predicts logs, and reasons to doubt that."""
    return document(
        f"{robot(fit)} validated",
        headline(fit, scores, "validated dynamics", _scored(scores), doubts),
        judged(fit, scores),
        data_quality(fit, scores),
        provenance(fit, command, {}),
    )


def _facts(fit: Fit) -> dict[str, str]:
    logs = len(fit.sources)
    return {
        "trained on": f"{fit.n_samples:,} samples, {logs} log{'s' if logs > 1 else ''}",
        "rank": f"{fit.rank} of {fit.n_parameters}",
    }


def _scored(scores: Sequence[Score]) -> dict[str, str]:
    seconds = float(np.sum([score.duration for score in scores]))
    return {"logs": str(len(scores)), "scored": f"{number(seconds, 3)} s of motion"}
