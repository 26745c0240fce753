"""Motion -> Fit: what the arm is, and how sure that is."""

from urdyn.identify.fit import Fit
from urdyn.identify.identify import identify
from urdyn.identify.noise import Noise
from urdyn.identify.rank import base_parameters
from urdyn.identify.search import Run
from urdyn.identify.unknowns import PayloadPrior
from urdyn.identify.validate import Score, validate

__all__ = [
    "Fit",
    "Noise",
    "PayloadPrior",
    "Run",
    "Score",
    "base_parameters",
    "identify",
    "validate",
]
