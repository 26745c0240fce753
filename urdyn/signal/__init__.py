"""Log -> Motion."""

from urdyn.signal.causal import Causal, CausalState
from urdyn.signal.condition import condition, conditioned, require_measured, stream
from urdyn.signal.features import Features, add_features, features
from urdyn.signal.gate import Gate
from urdyn.signal.kinematics import Kinematics, kinematics
from urdyn.signal.measured import measured
from urdyn.signal.normalise import Scaling, normalise
from urdyn.signal.outliers import hampel, reject_outliers
from urdyn.signal.pipeline import PAPER, Pipeline, Run, Stage
from urdyn.signal.polynomial import LocalPolynomial, half_window, weights
from urdyn.signal.sample import BESIDE, POSE, SETTING, UNSET, Instant, Sample, samples
from urdyn.signal.smooth import smooth
from urdyn.signal.synchronise import synchronise
from urdyn.signal.touch import Touch, in_contact, touch_of

__all__ = [
    "BESIDE",
    "PAPER",
    "POSE",
    "SETTING",
    "UNSET",
    "Causal",
    "CausalState",
    "Features",
    "Gate",
    "Instant",
    "Kinematics",
    "LocalPolynomial",
    "Pipeline",
    "Run",
    "Sample",
    "Scaling",
    "Stage",
    "Touch",
    "add_features",
    "condition",
    "conditioned",
    "features",
    "half_window",
    "hampel",
    "in_contact",
    "kinematics",
    "measured",
    "normalise",
    "reject_outliers",
    "require_measured",
    "samples",
    "smooth",
    "stream",
    "synchronise",
    "touch_of",
    "weights",
]
