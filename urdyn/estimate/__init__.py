"""Filters behind one protocol, and the loop that runs them over a history."""

from urdyn.estimate.bank import Bank
from urdyn.estimate.bound import Bound, posterior_bound
from urdyn.estimate.consider import Consider
from urdyn.estimate.ekf import EKF
from urdyn.estimate.information import InformationFilter
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.kalman import Kalman
from urdyn.estimate.learn import Learnt, expectation_maximisation, maximise_evidence, parameter_cov
from urdyn.estimate.particle import ParticleFilter
from urdyn.estimate.protocol import Filter, Track, track
from urdyn.estimate.ramps import follow_ramp, ramp_bank, ramp_bound, ramp_model
from urdyn.estimate.smoother import FixedLag, smooth
from urdyn.estimate.ukf import UKF
from urdyn.estimate.variational import Variational

__all__ = [
    "EKF",
    "UKF",
    "Bank",
    "Bound",
    "Consider",
    "Filter",
    "FixedLag",
    "InformationFilter",
    "Innovation",
    "Kalman",
    "Learnt",
    "ParticleFilter",
    "Track",
    "Variational",
    "expectation_maximisation",
    "follow_ramp",
    "maximise_evidence",
    "parameter_cov",
    "posterior_bound",
    "ramp_bank",
    "ramp_bound",
    "ramp_model",
    "smooth",
    "track",
]
