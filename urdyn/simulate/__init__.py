"""The virtual arm: the ground truth for every test."""

from urdyn.simulate.deviations import deviated, draw_deviations
from urdyn.simulate.faults import KINDS, Fault, parse_fault
from urdyn.simulate.follow import inverse
from urdyn.simulate.forward import forward, typical_gears
from urdyn.simulate.fourier import fourier
from urdyn.simulate.heat import Heat, typical_heat
from urdyn.simulate.motions import MOTIONS, plan
from urdyn.simulate.moves import point_to_point
from urdyn.simulate.observe import Fidelity, observe
from urdyn.simulate.payload import Payload
from urdyn.simulate.playback import from_file
from urdyn.simulate.recorder import POLLING, RECORDERS, SEVERAL_RATES, Recorder
from urdyn.simulate.schedule import Course, Event, course
from urdyn.simulate.sensors import Sensors, perfect_sensors, real_sensors, typical_sensors
from urdyn.simulate.to_and_fro import to_and_fro
from urdyn.simulate.trajectory import Trajectory
from urdyn.simulate.truth import truth, write_truth
from urdyn.simulate.unfolding import unfolding
from urdyn.simulate.virtual import happening, simulate, streams, virtual_arm, with_deviations
from urdyn.simulate.warmth import warm_up
from urdyn.simulate.work import Work, pick_and_place, shift

__all__ = [
    "KINDS",
    "MOTIONS",
    "POLLING",
    "RECORDERS",
    "SEVERAL_RATES",
    "Course",
    "Event",
    "Fault",
    "Fidelity",
    "Heat",
    "Payload",
    "Recorder",
    "Sensors",
    "Trajectory",
    "Work",
    "course",
    "deviated",
    "draw_deviations",
    "forward",
    "fourier",
    "from_file",
    "happening",
    "inverse",
    "observe",
    "parse_fault",
    "perfect_sensors",
    "pick_and_place",
    "plan",
    "point_to_point",
    "real_sensors",
    "shift",
    "simulate",
    "streams",
    "to_and_fro",
    "truth",
    "typical_gears",
    "typical_heat",
    "typical_sensors",
    "unfolding",
    "virtual_arm",
    "warm_up",
    "with_deviations",
    "write_truth",
]
