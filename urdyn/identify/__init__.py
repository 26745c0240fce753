"""Motion -> Fit: the arm, and its uncertainty."""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.identify.batch import identify
    from urdyn.identify.fit import Fit
    from urdyn.identify.noise import Noise
    from urdyn.identify.rank import base_parameters
    from urdyn.identify.scoring import Score, validate
    from urdyn.identify.search import Run
    from urdyn.identify.unknowns import PayloadPrior

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

# Tracking a twin needs Fit and Noise, but neither CasADi nor SciPy's filters.
__getattr__ = lookup(
    __name__,
    {
        "urdyn.identify.batch": ("identify",),
        "urdyn.identify.fit": ("Fit",),
        "urdyn.identify.noise": ("Noise",),
        "urdyn.identify.rank": ("base_parameters",),
        "urdyn.identify.scoring": ("Score", "validate"),
        "urdyn.identify.search": ("Run",),
        "urdyn.identify.unknowns": ("PayloadPrior",),
    },
)
