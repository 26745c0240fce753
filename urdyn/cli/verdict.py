"""A table's message, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from urdyn.report.evidence import pool, telling
from urdyn.report.identify.headline import sentence
from urdyn.report.names import joints

if TYPE_CHECKING:
    from urdyn.identify import Fit, Score


def verdict(fit: Fit, scores: Sequence[Score]) -> str:
    """How well the model predicts, by its best joint and its worst."""
    return sentence(pool(fit, telling(fit, scores)), joints(fit))
