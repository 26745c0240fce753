"""A run's results, as `urdyn track --json` prints them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from urdyn.estimate.protocol import S
from urdyn.io.plain import plain
from urdyn.tracking.belief.physical import Quantities
from urdyn.tracking.output.checkpoint import Checkpoint
from urdyn.tracking.sources.losses import as_plain, too_sparse
from urdyn.tracking.sources.source import Source
from urdyn.tracking.step.tracker import Tracker


@dataclass(frozen=True, eq=False)
class Summary:
    """A finished run in plain numbers; fields are named as the document's keys."""

    robot: str
    samples: int
    lost: int | None  # samples that a live source did not send, over the run; None: recorded
    data_s: float  # from the first stamp to the last, without gaps
    wall_s: float
    rate_hz: float  # samples per second of computing
    latency_ms: Mapping[str, float]
    rss_mb: float  # peak memory
    filter: str
    mode: str
    final: Mapping[str, Any]  # mean, sd and unit of each quantity
    quantities: Mapping[str, Any]  # margins, power and predictive error, joint by joint
    quality: Mapping[str, Any]  # of the stream
    payload_changes: list[float]  # [s]
    payload_known: bool  # currents have told what is carried; else its mean may be far off
    payload_setting: Mapping[str, Any] | None  # of the controller; None: not reported

    def plain(self) -> dict[str, Any]:
        """The document."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def ill_sensors(found: Mapping[str, Any]) -> list[str]:
    """Joints whose current sensor is not to be trusted, so that it weighs no payload.

    A bias of a current is explained by another load, drive and zero at once, each of them wrong.

    Args:
        found: an observer's document; one without findings names none.
    """
    findings = found.get("findings", ())
    return [f["name"] for f in findings if f["kind"] == "sensor_fault" and not f["gone"]]


def final(tracker: Tracker[S], of: Quantities, at: Checkpoint[S]) -> dict[str, Any]:
    """Mean, standard deviation and unit of each quantity, as believed at the end."""
    belief = tracker.believed(at.state)
    mean, sd = of.of(belief, tracker.estimates_beside(at.state))
    rows = zip(of.names, map(plain, mean), map(plain, sd), of.units, strict=True)
    return {name: {"mean": m, "sd": sd, "unit": unit} for name, m, sd, unit in rows}


def quality(tracker: Tracker[S], source: Source, at: Checkpoint[S]) -> dict[str, Any]:
    """What the stream lacked, which joints' loss ended it, and how often it was not this arm's."""
    counts = at.state.causal.refused, at.state.undrawn
    lacked = as_plain(at.losses, *counts, source.defects, at.index)
    return lacked | {
        "undriven": lacked["undriven"] + int(at.state.hand.samples),
        "in_contact": lacked["in_contact"] + int(at.state.touched),
        "stuck": at.state.stuck.astype(int).tolist(),
        "frozen": _frozen(tracker, at),
        "lost": _lost(tracker, at),
        "too_sparse": too_sparse(at.losses, source.period),
        "restarts": int(at.state.restarts),
        "compared": at.interest.samples.astype(int).tolist(),
    }


def _frozen(tracker: Tracker[S], at: Checkpoint[S]) -> list[dict[str, Any]]:
    """Joints whose velocity was stuck while they moved: how many samples, and since when [s]."""
    names, causal = tracker.fit.dynamics.arm.joint_names, at.state.causal
    rows = zip(names, causal.frozen, causal.frozen_since, strict=True)
    return [{"joint": name, "samples": int(n), "since": float(t)} for name, n, t in rows if n]


def _lost(tracker: Tracker[S], at: Checkpoint[S]) -> dict[str, Any] | None:
    """Since when tracking has stopped, and for lack of which joints' angles; None: it goes on."""
    t, lacking, _ = tracker.missed(at.state)
    if not (lacking.any() and at.state.t < t):
        return None
    names = tracker.fit.dynamics.arm.joint_names
    return {"since": at.state.t, "joints": [names[j] for j in np.flatnonzero(lacking)]}
