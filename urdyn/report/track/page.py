"""The self-contained page of a tracked run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urdyn.report.findings import unjudged
from urdyn.report.markup import document
from urdyn.report.names import maker
from urdyn.report.track.change import LEVELS, changes
from urdyn.report.track.findings import findings
from urdyn.report.track.forecast import forecasts
from urdyn.report.track.headline import track_headline
from urdyn.report.track.history import PAYLOAD, History
from urdyn.report.track.interest import interest
from urdyn.report.track.kinematics import holds_kinematics, kinematics
from urdyn.report.track.network import network
from urdyn.report.track.origin import track_origin
from urdyn.report.track.payload import payload
from urdyn.report.track.quality import quality
from urdyn.report.track.surprise import surprise, surprises
from urdyn.report.track.trends import link_masses, trends


def track_page(run: History, summary: Mapping[str, Any]) -> str:
    """HTML of a tracked run.

    Args:
        run: mean and `.sd` of every quantity, currents, and surprise over time.
        summary: robot, samples, times, latency, and when the tracker found payload changes.
    """
    unseen, surprised = unjudged(summary.get("joints", ())), surprise(run)
    found = changes(run, unseen, summary.get("levels", LEVELS))
    changed = [float(t) - run.start for t in summary["payload_changes"]]
    return document(
        f"{maker(str(summary['robot']))} tracked",
        track_headline(run, summary, found, changed, surprised),
        *([findings(run, summary), forecasts(run, summary)] if "findings" in summary else []),
        *([payload(run, changed)] if run.holds(PAYLOAD, "mass") else []),
        *([interest(summary["quantities"])] if "quantities" in summary else []),
        trends(run, found),
        *([kinematics(run)] if holds_kinematics(run) else []),
        surprises(run, surprised),
        link_masses(run),
        network(),
        *([quality(run, summary)] if "quality" in summary else []),
        track_origin(run, summary),
    )
