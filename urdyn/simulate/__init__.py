"""The virtual arm: the ground truth of every test."""

from urdyn.simulate.fourier import fourier
from urdyn.simulate.moves import point_to_point
from urdyn.simulate.payload import Payload
from urdyn.simulate.playback import from_file
from urdyn.simulate.sensors import Sensors, observe, perfect_sensors, typical_sensors
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.truth import truth, write_truth
from urdyn.simulate.virtual import simulate, virtual_arm

__all__ = [
    "Payload",
    "Sensors",
    "Trajectory",
    "fourier",
    "from_file",
    "observe",
    "perfect_sensors",
    "point_to_point",
    "simulate",
    "truth",
    "typical_sensors",
    "virtual_arm",
    "write_truth",
]
