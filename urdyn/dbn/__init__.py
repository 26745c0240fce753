"""The dynamic Bayesian network, and the models that it compiles to."""

from urdyn.dbn.affine import AffineObservation
from urdyn.dbn.compile import CompiledNetwork, compile_linear, places
from urdyn.dbn.drawing import svg
from urdyn.dbn.figure2 import figure2
from urdyn.dbn.graph import Edge, Network, Node
from urdyn.dbn.joined import Joined
from urdyn.dbn.jumps import Jumps, jumps
from urdyn.dbn.learn import learn_diffusion, learn_measurement_noise, learn_network
from urdyn.dbn.mixed_graph import MixedGraph
from urdyn.dbn.process import RandomWalk
from urdyn.dbn.smoothed import Smoothed, observation_residuals, process_residuals
from urdyn.dbn.trend import Trend
from urdyn.dbn.two_slice import Observation, Process, Slice, Tick, TwoSlice

__all__ = [
    "AffineObservation",
    "CompiledNetwork",
    "Edge",
    "Joined",
    "Jumps",
    "MixedGraph",
    "Network",
    "Node",
    "Observation",
    "Process",
    "RandomWalk",
    "Slice",
    "Smoothed",
    "Tick",
    "Trend",
    "TwoSlice",
    "compile_linear",
    "figure2",
    "jumps",
    "learn_diffusion",
    "learn_measurement_noise",
    "learn_network",
    "observation_residuals",
    "places",
    "process_residuals",
    "svg",
]
