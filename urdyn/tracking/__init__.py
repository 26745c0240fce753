"""A twin at work: sample in, belief and surprise out."""

from urdyn.tracking.checkpoint import Checkpoint
from urdyn.tracking.learning import drift_of, learn_edges, learn_wear
from urdyn.tracking.model import Drift, tracking_model
from urdyn.tracking.modes import MODES, QUICKER, Loss, Mode, losses, side_by_side
from urdyn.tracking.physical import Quantities, quantities
from urdyn.tracking.run import Glance, Observer, run
from urdyn.tracking.source import Arrival, Source, open_source
from urdyn.tracking.tracker import Reading, Tracker, TrackerState

__all__ = [
    "MODES",
    "QUICKER",
    "Arrival",
    "Checkpoint",
    "Drift",
    "Glance",
    "Loss",
    "Mode",
    "Observer",
    "Quantities",
    "Reading",
    "Source",
    "Tracker",
    "TrackerState",
    "drift_of",
    "learn_edges",
    "learn_wear",
    "losses",
    "open_source",
    "quantities",
    "run",
    "side_by_side",
    "tracking_model",
]
