"""Carrying out a campaign: recordings -> a fit and its scores."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

import urdyn as ud
from urdyn.cli.campaign import Campaign
from urdyn.cli.recording import Recording
from urdyn.cli.tool import Tool, setting_of
from urdyn.cli.virtual import record
from urdyn.cli.voice import complaints
from urdyn.errors import InputError
from urdyn.io.effort import Effort
from urdyn.io.twice import refuse_twice
from urdyn.model.population import population
from urdyn.model.whose import require_own
from urdyn.progress import Progress

if TYPE_CHECKING:
    from urdyn.identify import Score
    from urdyn.model.arm import Arm
    from urdyn.types import Array

SHOWN = 30_000  # rows of a training log that are scored for the page


@dataclass(frozen=True)
class Outcome:
    """Results of a campaign."""

    fit: ud.Fit
    scores: tuple[Score, ...]  # of the training logs, then of those that were held out
    wall: float  # [s] of reading and identifying
    truth: dict[str, Any] | None  # of a virtual arm
    defects: tuple[str, ...]  # of the logs
    setting: Tool | None  # payload set in the controller; None: in no log


def carry_out(campaign: Campaign, progress: Progress) -> Outcome:
    """Record if the arm is virtual, identify, score."""
    from urdyn.identify.scoring import amiss_in

    arm = ud.load_arm(campaign.robot)
    gain = gains(campaign, arm)
    campaign, truth = _recorded(_in_amperes(campaign, arm), arm)
    begin = time.perf_counter()
    logs = [_conditioned(one, arm) for one in (*campaign.logs, *campaign.payloads)]
    motions = [motion for motion, *_ in logs]
    refuse_twice([motion.source for motion in motions])
    bare, rest = motions[: len(campaign.logs)], motions[len(campaign.logs) :]
    masses = [ud.PayloadPrior(recording.mass) for recording in campaign.payloads]
    tool = None if campaign.tool is None else campaign.tool.inertials()
    loaded = [*map(ud.Run, rest, masses)]
    fit = ud.identify(arm, *bare, loaded=loaded, gain=gain, tool=tool, progress=progress)
    wall = time.perf_counter() - begin
    progress("scoring", 1.0)
    seen = [ud.validate(fit, one.read()) for one in map(_beginning, campaign.logs, bare)]
    held_out = [ud.validate(fit, one.read()) for one in campaign.validate]
    defects = [defect for _, found, _ in logs for defect in found]
    settings = [setting for *_, setting in logs[: len(bare)] if setting]
    for motion in motions:
        amiss = amiss_in(fit.dynamics, motion.q, motion.current)
        defects += complaints(motion.source.path, amiss)
    for recording, score in zip(campaign.validate, held_out, strict=True):
        defects += recording.complaints(score.log)
    setting = settings[-1] if settings else None
    return Outcome(fit, (*seen, *held_out), wall, truth, tuple(defects), setting)


def _conditioned(recording: Recording, arm: Arm) -> tuple[ud.Motion, list[str], Tool | None]:
    """A recording's motion, its log's defects, and the payload set in the controller.

    The log itself need not be kept.
    """
    from urdyn.signal import conditioned, measured

    log = measured(recording.read())
    require_own(arm, log)
    return conditioned(log), recording.complaints(log), setting_of(log)


def _beginning(recording: Recording, motion: ud.Motion) -> Recording:
    """As much of a recording as a page can show: an hour is not held in memory."""
    if len(motion) <= SHOWN:
        return recording
    first = (recording.rows or (0, None))[0] or 0
    return replace(recording, rows=(first, first + SHOWN))


def gains(campaign: Campaign, arm: Arm) -> Array | None:
    """Drive gains that are known, (J,) [N·m/A]; None: they are estimated."""
    if campaign.drive_gain is None:
        # Torque in N·m was computed with a gain: the one it is divided by takes its place.
        return typical_gain(arm) if campaign.effort_unit == "Nm" else None
    gain = np.array(campaign.drive_gain)
    if len(gain) != arm.joints or not (np.isfinite(gain).all() and (gain > 0.0).all()):
        raise InputError(f"drive gains: {arm.name} takes {arm.joints} positive numbers, N·m/A each")
    return gain


def typical_gain(arm: Arm) -> Array:
    """Typical drive gains of such joints, (J,) [N·m/A]."""
    return population(arm).drive["gain"].typical


def _in_amperes(campaign: Campaign, arm: Arm) -> Campaign:
    """The campaign with the unit of bags' efforts in its recordings."""
    gain = gains(campaign, arm) if campaign.effort_unit == "Nm" else None
    effort = Effort(campaign.effort_unit, gain)

    def told(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
        return tuple(replace(one, effort=effort) for one in recordings)

    return replace(
        campaign,
        logs=told(campaign.logs),
        payloads=told(campaign.payloads),
        validate=told(campaign.validate),
    )


def _recorded(campaign: Campaign, arm: Arm) -> tuple[Campaign, dict[str, Any] | None]:
    """The campaign with recordings in it, and the truth where its arm is virtual."""
    if campaign.simulate is None:
        return campaign, None
    virtual = record(arm, campaign.simulate, campaign.out)
    loaded = (virtual.loaded,) if virtual.loaded else ()
    held_out = (*campaign.validate, virtual.held_out)
    return replace(campaign, logs=(virtual.log,), payloads=loaded, validate=held_out), virtual.truth
