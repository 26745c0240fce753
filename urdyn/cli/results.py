"""Carrying out a campaign, and the files that come of it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import urdyn as ud
from urdyn.cli.campaign import Campaign
from urdyn.cli.recording import Recording, refuse_twice
from urdyn.cli.virtual import record
from urdyn.cli.voice import Voice
from urdyn.errors import InputError
from urdyn.io import dump_toml, write_text
from urdyn.model.describe import describe
from urdyn.twin import document

if TYPE_CHECKING:
    from urdyn.identify import Score
    from urdyn.model.arm import Arm
    from urdyn.types import Array, Source

FILES = ("twin.toml", "identified.urdf", "report.html")
SHOWN = 100_000  # rows of a training log that are scored for the page


@dataclass(frozen=True)
class Outcome:
    """What a campaign found."""

    fit: ud.Fit
    scores: tuple[Score, ...]  # of the training logs, then of those that were held out
    wall: float  # [s] of reading and identifying
    truth: dict[str, Any] | None  # of a virtual arm


def carry_out(campaign: Campaign, voice: Voice) -> Outcome:
    """Record where the arm is virtual, identify, score."""
    arm = ud.load_arm(campaign.robot)
    gain = gains(campaign, arm)
    require_folder(campaign.out)
    with voice.progress("reading") as told:
        campaign, truth = _recorded(campaign, arm, voice)
        begin = time.perf_counter()
        bare = [_motion(recording, voice) for recording in campaign.logs]
        loaded = [
            ud.Run(_motion(recording, voice), ud.PayloadPrior(recording.mass))
            for recording in campaign.payloads
        ]
        refuse_twice([motion.source for motion in (*bare, *(run.motion for run in loaded))])
        fit = ud.identify(arm, *bare, loaded=loaded, gain=gain, progress=told)
        wall = time.perf_counter() - begin
        told("scoring", 1.0)
        shown = map(_beginning, campaign.logs, map(len, bare))
        seen = [ud.validate(fit, recording.read()) for recording in shown]
        held_out = [ud.validate(fit, read(recording, voice)) for recording in campaign.validate]
    return Outcome(fit, (*seen, *held_out), wall, truth)


def read(recording: Recording, voice: Voice) -> ud.Log:
    """A recording's log; what was amiss with it is told."""
    log = recording.read()
    for defect in log.defects:
        voice.note(f"{log.source.path}: {defect}")
    return log


def _motion(recording: Recording, voice: Voice) -> ud.Motion:
    return ud.condition(read(recording, voice))


def _beginning(recording: Recording, rows: int) -> Recording:
    """As much of a recording of so many rows as a page can show: an hour is not held in memory."""
    if rows <= SHOWN:
        return recording
    first = (recording.rows or (0, None))[0] or 0
    return replace(recording, rows=(first, first + SHOWN))


def gains(campaign: Campaign, arm: Arm) -> Array | None:
    """Drive gains that are known, (J,) [N·m/A]; None: they are sought."""
    if campaign.effort_unit == "Nm":
        return np.ones(arm.joints)
    if campaign.drive_gain is None:
        return None
    gain = np.array(campaign.drive_gain)
    if len(gain) != arm.joints or not (np.isfinite(gain).all() and (gain > 0.0).all()):
        raise InputError(f"drive gains: {arm.name} takes {arm.joints} positive numbers, N·m/A each")
    return gain


def require_folder(out: Path) -> None:
    """InputError where results cannot lie in `out`, before anybody has waited for them."""
    for path in (out, *out.parents):
        if path.exists():
            if not path.is_dir():
                raise InputError(f"{out}: cannot be a folder of results: {path} is a file")
            return


def save(fit: ud.Fit, page: str, out: Path) -> None:
    """Write FILES; all are made before any is written."""
    heading = "urdyn {}: identified from {}".format(
        ud.__version__, ", ".join(_citation(source) for source in fit.sources)
    )
    urdf = describe(fit.dynamics.arm, fit.dynamics.inertials, heading)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(FILES, (dump_toml(document(fit)), urdf, page), strict=True):
        write_text(out / name, text)


def _recorded(campaign: Campaign, arm: Arm, voice: Voice) -> tuple[Campaign, dict[str, Any] | None]:
    """The campaign with recordings in it, and the truth where its arm is virtual."""
    if campaign.simulate is None:
        return campaign, None
    virtual = record(arm, campaign.simulate, campaign.out)
    loaded = (virtual.loaded,) if virtual.loaded else ()
    held_out = (*campaign.validate, virtual.held_out)
    return replace(campaign, logs=(virtual.log,), payloads=loaded, validate=held_out), virtual.truth


def _citation(source: Source) -> str:
    return f"{source.path} (sha256 {source.sha256[:12]})"
