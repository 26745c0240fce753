"""A twin at work: sample in, belief and surprise out.

Its rooms, each of which imports only from those below it, beside the files here that run the step:

    output   history and checkpoint on disk, progress and summary, live topics
    step     currents compared, changes detected, states learnt
    streams  poses and the wrench, at rates of their own
    belief   the states and their prior, how filters hold it, what it means
    noise    the currents' noise; beside it, sources: recordings and live robots
"""

from typing import TYPE_CHECKING

from urdyn.lazy import lookup

if TYPE_CHECKING:
    from urdyn.tracking.belief.model import Drift, tracking_model
    from urdyn.tracking.belief.physical import Quantities, quantities
    from urdyn.tracking.belief.reading import Reading
    from urdyn.tracking.learning import drift_of, learn_edges, learn_wear
    from urdyn.tracking.modes import MODES, QUICKER, Loss, Mode, losses, side_by_side
    from urdyn.tracking.output.checkpoint import Checkpoint
    from urdyn.tracking.output.keeper import begin_scribe
    from urdyn.tracking.output.observer import Observer
    from urdyn.tracking.output.progress import RunProgress
    from urdyn.tracking.rehearsal import rehearse
    from urdyn.tracking.run import run
    from urdyn.tracking.sources.open_source import open_source
    from urdyn.tracking.sources.source import Arrival, Source
    from urdyn.tracking.step.state import TrackerState
    from urdyn.tracking.step.tracker import Tracker

__all__ = [
    "MODES",
    "QUICKER",
    "Arrival",
    "Checkpoint",
    "Drift",
    "Loss",
    "Mode",
    "Observer",
    "Quantities",
    "Reading",
    "RunProgress",
    "Source",
    "Tracker",
    "TrackerState",
    "begin_scribe",
    "drift_of",
    "learn_edges",
    "learn_wear",
    "losses",
    "open_source",
    "quantities",
    "rehearse",
    "run",
    "side_by_side",
    "tracking_model",
]

# A diagnosis needs no filter, and tracking a robot needs nothing that learns from histories.
__getattr__ = lookup(
    __name__,
    {
        "urdyn.tracking.output.checkpoint": ("Checkpoint",),
        "urdyn.tracking.output.progress": ("RunProgress",),
        "urdyn.tracking.output.keeper": ("begin_scribe",),
        "urdyn.tracking.learning": ("drift_of", "learn_edges", "learn_wear"),
        "urdyn.tracking.belief.model": ("Drift", "tracking_model"),
        "urdyn.tracking.modes": ("MODES", "QUICKER", "Loss", "Mode", "losses", "side_by_side"),
        "urdyn.tracking.output.observer": ("Observer",),
        "urdyn.tracking.belief.physical": ("Quantities", "quantities"),
        "urdyn.tracking.belief.reading": ("Reading",),
        "urdyn.tracking.rehearsal": ("rehearse",),
        "urdyn.tracking.run": ("run",),
        "urdyn.tracking.sources.open_source": ("open_source",),
        "urdyn.tracking.sources.source": ("Arrival", "Source"),
        "urdyn.tracking.step.state": ("TrackerState",),
        "urdyn.tracking.step.tracker": ("Tracker",),
    },
)
