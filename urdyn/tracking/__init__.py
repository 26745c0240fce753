"""A twin at work: sample in, belief and surprise out."""

from urdyn.tracking.checkpoint import Checkpoint
from urdyn.tracking.model import Drift, tracking_model
from urdyn.tracking.physical import Quantities, quantities
from urdyn.tracking.run import Glance, Observer, run
from urdyn.tracking.source import Arrival, Source, open_source
from urdyn.tracking.tracker import Reading, Tracker, TrackerState

__all__ = [
    "Arrival",
    "Checkpoint",
    "Drift",
    "Glance",
    "Observer",
    "Quantities",
    "Reading",
    "Source",
    "Tracker",
    "TrackerState",
    "open_source",
    "quantities",
    "run",
    "tracking_model",
]
