"""Filters behind one protocol, and the loop that runs them over a history."""

from urdyn.estimate.bank import Bank
from urdyn.estimate.consider import Consider
from urdyn.estimate.ekf import EKF
from urdyn.estimate.information import InformationFilter
from urdyn.estimate.innovation import Innovation
from urdyn.estimate.kalman import Kalman
from urdyn.estimate.learn import Learnt, expectation_maximisation, maximise_evidence
from urdyn.estimate.particle import ParticleFilter
from urdyn.estimate.protocol import Filter, Track, track
from urdyn.estimate.smoother import FixedLag, smooth
from urdyn.estimate.ukf import UKF
from urdyn.estimate.variational import Variational

__all__ = [
    "EKF",
    "UKF",
    "Bank",
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
    "maximise_evidence",
    "smooth",
    "track",
]
